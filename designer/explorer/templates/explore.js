"use strict";
// The page of `designer explore`. What it asks goes through a `line`: a socket to the server, or
// the recording that a saved page carries.
(() => {
  const PERIODS = ["#888888", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9",
    "#a06a00", "#7a5ccf"];
  const OPEN = "#bbbbbb";
  const REST = "#c9c9c9"; // of the map's responses without a colour of their own
  const STEPS = 2000;
  const GAP = 65535; // what a column of 16-bit steps has for no number
  const BOARD = -2; // number of the question about parts
  const MAP = -1000; // numbers of those about the map start here and fall
  const page = JSON.parse(document.getElementById("page").textContent);
  const { recording, losses } = page;
  const by = (id) => document.getElementById(id);
  const root = document.documentElement;

  const nearest = (omega) => recording.omegas.reduce((best, each, k, all) =>
    Math.abs(Math.log(each / omega)) < Math.abs(Math.log(all[best] / omega)) ? k : best, 0);

  // --- controls -------------------------------------------------------------------------------
  const controls = [...document.querySelectorAll(".control")].map((box) => {
    const d = box.dataset;
    const c = { name: d.name, low: +d.low, high: +d.high, own: d.value, log: d.log === "1",
      unit: d.unit, scale: +d.scale, field: box.querySelector(".number"), slider: box.querySelector(".slider") };
    c.at = (place) => {
      const part = place / STEPS;
      return c.log ? c.low * (c.high / c.low) ** part : c.low + (c.high - c.low) * part;
    };
    c.place = (value) => {
      const part = c.log ? Math.log(value / c.low) / Math.log(c.high / c.low)
        : (value - c.low) / (c.high - c.low);
      return Math.round(STEPS * Math.min(1, Math.max(0, part)));
    };
    if (recording) { // the slider stops at what is recorded, and nowhere else
      c.slider.max = recording.omegas.length - 1;
      c.at = (place) => recording.omegas[place];
      c.place = nearest;
    }
    c.written = (text) => (c.scale === 1 || !Number.isFinite(Number(text)) ? short(text)
      : String(Number((Number(text) * c.scale).toPrecision(7)))); // in the unit that is shown
    // What the server makes the number of: with its unit, so that 36 Hz stays 36 Hz.
    c.asText = (shown) => (c.scale === 1 || shown === "" || !Number.isFinite(Number(shown)) ? shown
      : recording ? String(Number(shown) / c.scale) : `${shown} ${c.unit}`);
    c.labelled = (value) => `${d.label} = ${c.round(value)} ${c.unit}`.trim();
    c.round = (value) => String(Number((value * c.scale).toPrecision(6)));
    c.show = (text) => {
      c.text = text;
      if (document.activeElement !== c.field) c.field.value = c.written(text);
      const value = Number(text);
      if (Number.isFinite(value)) c.slider.value = c.place(value);
      c.slider.setAttribute("aria-valuetext", `${c.written(text)} ${c.unit}`.trim());
      c.field.removeAttribute("aria-invalid");
    };
    c.go = (value) => {
      const shown = c.round(value);
      c.field.value = shown;
      c.show(c.scale === 1 ? shown : String(Number(shown) / c.scale));
      c.text = c.asText(shown);
      c.asked = c.scale !== 1;
    };
    c.slider.addEventListener("input", () => {
      c.go(c.at(+c.slider.value));
      want();
    });
    c.field.addEventListener("change", () => { c.text = c.asText(c.field.value.trim()); c.asked = true; want(); });
    return c;
  });
  const named = Object.fromEntries(controls.map((c) => [c.name, c]));
  // What stays at the top: the head, or on a phone the part of it that does not scroll away.
  const measureHead = () => root.style.setProperty("--head",
    `${document.querySelector("header").offsetHeight || by("state").offsetHeight}px`);
  for (const each of [document.querySelector("header"), by("state")]) {
    new ResizeObserver(measureHead).observe(each);
  }
  let width = innerWidth; // a phone changes the height alone whenever its address bar hides
  window.addEventListener("resize", () => {
    if (width !== innerWidth) by("facts").style.minHeight = "";
    width = innerWidth;
  });
  const short = (text) => {
    const value = Number(text);
    return Number.isFinite(value) && text.length > 9 ? String(Number(value.toPrecision(7))) : text;
  };

  // --- the state, which the address holds -----------------------------------------------------
  let start = "", pins = [], shownView = null;
  const words = () => {
    const out = {};
    for (const c of controls) if (c.text !== c.own) out[c.name] = c.text;
    if (by("shown").value !== "0") out.shown = by("shown").value;
    if (by("follow").checked && start) out.start = start;
    return out;
  };
  const address = () => {
    const query = new URLSearchParams(words());
    if (by("follow").checked) query.set("follow", "1");
    for (const pin of pins) query.append("pin", pin);
    if (map) query.set("map", MAP_WORDS.map((key) => map[key]).join("~"));
    const text = query.toString();
    // A page from a file may change nothing of its address but what is behind the #.
    if (recording) return `#${text}`;
    return text ? `?${text}` : location.pathname;
  };
  const readAddress = () => {
    const query = new URLSearchParams(recording ? location.hash.slice(1) : location.search);
    for (const c of controls) c.show(query.get(c.name) ?? c.own);
    by("shown").value = query.get("shown") ?? "0";
    by("follow").checked = query.has("follow");
    start = query.get("start") ?? "";
    pins = query.getAll("pin").filter((pin) => pin.split("~").length === 3);
    showPins();
    if (!recording) readMap(query.get("map"));
  };

  // --- asking: one question is under way; of those behind it only the newest is kept ------------
  let number = 0, underWay = 0, wanted = false, asked = 0;
  const want = () => { asked = performance.now(); wanted = true; pump(); };
  const pump = () => {
    if (!wanted || underWay || !line.open) return;
    wanted = false;
    underWay = ++number;
    line.ask({ kind: "view", id: number, words: words() });
  };
  let busyTimer = 0;
  const notice = (text) => { by("notice").textContent = text; by("notice").hidden = !text; };

  const heard = (message) => {
    if (message.id >= 0 && message.id < number) return;
    (handlers[message.kind] ?? (() => {}))(message);
    if (message.id === underWay && message.first) {
      underWay = 0;
      // Bokeh paints in the next frame; what is put behind that frame comes after the picture.
      requestAnimationFrame(() => setTimeout(() => {
        root.dataset.drawn = message.id;
        root.dataset.latency = (performance.now() - asked).toFixed(1);
        pump();
      }));
    }
  };
  const handlers = {
    view(message) {
      notice("");
      start = message.start;
      shownView = message;
      by("pin").disabled = !/^\d+-/.test(message.response);
      const typing = document.activeElement;
      // A control that has moved on since keeps its newer value, which is asked next.
      for (const [name, text] of wanted ? [] : Object.entries(message.words)) {
        const c = named[name];
        if (c && (c.asked || Number(c.text) !== Number(text))) {
          c.asked = false;
          c.text = text;
          c.show(text);
          if (typing === c.field) c.field.value = c.written(text);
        }
      }
      for (const c of controls) c.field.removeAttribute("aria-invalid");
      by("summary").textContent = message.summary;
      by("in-sight").textContent = message.facts.filter(([name]) => page.in_sight.includes(name))
        .map(([name, text]) => `${name} = ${text}`).join(", ");
      const list = document.querySelector("#facts dl");
      by("tried").textContent = "";
      document.querySelector("#others ul").replaceChildren();
      table(list, message.facts);
      // Fewer figures leave their room: what stands below shall not jump while a slider is moved.
      by("facts").style.minHeight = `${by("facts").offsetHeight}px`;
      by("choose").disabled = by("pin").disabled;
      for (const name of ["portrait", "trace"]) {
        by(name).setAttribute("aria-label", `${name}: ${message.summary}`);
      }
      if (losses) by("moved").hidden = isOfLosses(message.words);
      draw(message);
      history.replaceState(null, "", address());
      followMap();
    },
    compiling(message) {
      // Kernels come one after another: what is said of them stays a moment longer.
      clearTimeout(busyTimer);
      const say = (text) => { if (by("busy").textContent !== text) by("busy").textContent = text; };
      if (message.on) say("The kernels are being compiled, once on this machine. It takes a minute or more.");
      else busyTimer = setTimeout(() => say(""), 700);
    },
    strip(message) {
      if (stripOf !== message.id) stripData = empty();
      stripOf = message.id;
      const data = unpacked(message.data);
      const colours = [...data.period].map((n) => (n < 0 ? OPEN : PERIODS[n] ?? PERIODS[0]));
      const periods = [...data.period].map((n) => (n < 0 ? "not settled" : n ? String(n) : "none"));
      const along = data.omega.map((omega) => omega * named.omega.scale);
      const least = data.x.map((x) => x * page.length.scale);
      stripData = { omega: joined(stripData.omega, along), x: joined(stripData.x, least),
        colour: stripData.colour.concat(colours), period: stripData.period.concat(periods) };
      later();
    },
    others(message) {
      by("tried").textContent = `${message.tried} of ${message.of} starts`;
      document.querySelector("#others ul").replaceChildren(...message.attractors.map((each, k) =>
        row(`${each.summary} (${each.starts})`, k ? ["Show", () => {
          by("follow").checked = true;
          start = each.start;
          want();
        }] : null)));
    },
    board(message) {
      by("boards").textContent = message.words;
      by("boards-bar").hidden = true;
      table(document.querySelector("#board dl"), message.rows);
    },
    yield(message) {
      by("boards").textContent = message.words;
      by("boards-bar").hidden = false;
      by("boards-bar").max = message.of;
      by("boards-bar").value = message.ok;
    },
    saved(message) {
      const missing = message.missing.length
        ? ` At these values the model does not show ${message.missing.join(", ")}.` : "";
      by("kept").textContent = `${message.name} is saved.${missing}`;
    },
    exists(message) {
      by("kept").textContent = `${message.name} is there already and says something else.`;
      by("again").hidden = false;
      by("overwrite").onclick = () => keep(message.verb, true);
      by("overwrite").focus();
    },
    job(message) {
      const words = message.status === null ? `at work: ${message.line}`
        : message.status === 0 ? "done" : `ended with ${message.status}: ${message.line}`;
      const item = row(`${message.name}, ${words}`, null);
      if (message.report) {
        const link = document.createElement("a");
        link.href = `report/${encodeURIComponent(message.name)}`;
        link.target = "_blank";
        link.textContent = "Open the report";
        item.append(link);
      }
      item.dataset.job = message.name;
      item.dataset.status = message.status ?? "";
      const old = [...by("jobs").children].find((each) => each.dataset.job === message.name);
      if (old) old.replaceWith(item); else by("jobs").append(item);
    },
    map(message) {
      if (message.id !== mapNumber) return;
      mapOf = message;
      grid = new Array(message.columns * message.rows);
      cells = { left: [], right: [], bottom: [], top: [], response: [] };
      cursor = null;
      for (const key of ["x", "y"]) {
        for (const end of ["low", "high"]) {
          map[`${key}_${end}`] = message[key][end];
          by(`map-${key}-${end}`).value = mapShown(key, message[key][end]);
        }
        by(`map-${key}`).value = message[key].name;
        mapUnits();
        const range = views.map.model[`${key}_range`];
        range.setv({ start: mapDrawn(key, +message[key].low), end: mapDrawn(key, +message[key].high) });
      }
      mapAsked = mapHeld + JSON.stringify(map); // with the ends that the server chose
      by("map-box").hidden = by("map-away").hidden = false;
      by("map-words").textContent = message.words;
      by("map-borders").textContent = "";
      axisLabel(views.map.model, "below", message.x.label);
      axisLabel(views.map.model, "left", message.y.label);
      fill("borders", { xs: [], ys: [], colour: [] });
      markHere();
      history.replaceState(null, "", address());
    },
    cells(message) {
      if (message.id !== mapNumber) return;
      const { columns, rows } = mapOf, half = message.stride / 2;
      for (const [i, j, response] of message.cells) {
        grid[i * columns + j] = response;
        cells.left.push(mapDrawn("x", mapValue("x", (j - half) / (columns - 1))));
        cells.right.push(mapDrawn("x", mapValue("x", (j + half) / (columns - 1))));
        cells.bottom.push(mapDrawn("y", mapValue("y", (i - half) / (rows - 1))));
        cells.top.push(mapDrawn("y", mapValue("y", (i + half) / (rows - 1))));
        cells.response.push(response);
      }
      looks = message.looks;
      mapLegend = message.legend;
      by("map-done").textContent = message.done < message.of
        ? `${message.done} of ${message.of} points.` : `All ${message.of} points.`;
      laterMap();
      if (message.done === message.of) askBorders();
    },
    borders(message) {
      if (message.id !== mapNumber) return;
      by("map-borders").textContent = message.words;
      if (!message.curves.length && !message.done) return;
      const lines = message.curves.map((curve) => unpacked(curve.data));
      borderLegend = message.legend;
      fill("borders", { xs: lines.map((each) => each.x.map((x) => mapDrawn("x", x))),
        ys: lines.map((each) => each.y.map((y) => mapDrawn("y", y))),
        colour: message.curves.map((each) => each.colour) });
      laterMap();
    },
    error(message) {
      if (message.id <= MAP) {
        if (message.id !== mapNumber) return;
        by("map-notice").textContent = message.text;
        by("map-notice").hidden = false;
        return;
      }
      if (message.id < 0) {
        by(message.id === BOARD ? "boards" : "kept").textContent = message.text;
        return;
      }
      notice(message.text);
      const name = controls.find((c) => message.text.startsWith(`${c.name}:`)
        || message.text.startsWith(`model.${c.name}:`));
      if (name) name.field.setAttribute("aria-invalid", "true");
    },
  };
  const table = (list, rows) => list.replaceChildren(...rows.flatMap(([name, text]) => {
    const pair = [document.createElement("dt"), document.createElement("dd")];
    pair[0].textContent = name;
    pair[1].textContent = text;
    return pair;
  }));
  const row = (text, action) => {
    const item = document.createElement("li"), words = document.createElement("span");
    words.textContent = text;
    item.append(words);
    if (action) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = action[0];
      button.setAttribute("aria-label", `${action[0]}: ${text}`);
      button.addEventListener("click", action[1]);
      item.append(button);
    }
    return item;
  };

  // --- what is kept -----------------------------------------------------------------------------
  const showPins = () => {
    by("pins").replaceChildren(...pins.map((pin) => {
      const [omega, expect, b] = pin.split("~");
      const { unit, written } = named.omega;
      const at = unit ? `${written(omega)} ${unit}` : `ω = ${short(omega)}`;
      return row(`${expect} at ${at}, b = ${short(b)}`, ["Remove", () => {
        pins = pins.filter((each) => each !== pin);
        showPins();
        history.replaceState(null, "", address());
      }]);
    }));
  };
  by("pin").addEventListener("click", () => {
    const { words: at, response } = shownView;
    const pin = `${at.omega}~${response}~${at.b}`;
    if (!pins.includes(pin)) pins.push(pin);
    showPins();
    history.replaceState(null, "", address());
  });
  by("choose").addEventListener("click", () => {
    if (!line.open) return;
    const { words: at, response } = shownView;
    by("boards").textContent = "…";
    table(document.querySelector("#board dl"), []);
    line.ask({ kind: "board", id: BOARD, words: at, expect: response });
  });
  const keep = (kind, overwrite) => {
    by("again").hidden = true;
    if (!line.open) return;
    by("kept").textContent = "…";
    line.ask({ kind, id: -1, words: words(), name: by("name").value, pins, overwrite });
  };
  for (const button of document.querySelectorAll("[data-keep]")) {
    button.addEventListener("click", () => keep(button.dataset.keep, false));
  }
  by("leave").addEventListener("click", () => {
    by("again").hidden = true;
    by("kept").textContent = "Nothing is written.";
  });
  const settled = () => { wanted = true; pump(); };

  // --- the map of responses ---------------------------------------------------------------------
  const MAP_WORDS = ["x", "x_low", "x_high", "y", "y_low", "y_high"];
  let map = null, mapOf = null, mapNumber = MAP, mapHeld = "", mapAsked = "", bordersAsked = "";
  let grid = [], cells = {}, looks = {}, mapLegend = [], borderLegend = [], cursor = null, mapTimer = 0;
  const mapPart = (key, value) => (value - mapOf[key].low) / (mapOf[key].high - mapOf[key].low);
  const mapValue = (key, part) => Number(mapOf[key].low) + part * (mapOf[key].high - mapOf[key].low);
  const mapDrawn = (key, value) => value * named[map[key]].scale;
  const mapShown = (key, text) => (named[map[key]] && text !== "" ? named[map[key]].written(text) : text);
  const readMap = (text) => {
    const parts = (text ?? "").split("~");
    map = parts.length === MAP_WORDS.length
      ? Object.fromEntries(MAP_WORDS.map((key, k) => [key, parts[k]])) : null;
    for (const key of map ? MAP_WORDS : []) {
      const side = key.split("_")[0];
      by(`map-${key.replace("_", "-")}`).value = key === side ? map[key] : mapShown(side, map[key]);
    }
    mapAsked = "";
    if (!map) mapAway();
  };
  const typedMap = () => Object.fromEntries(MAP_WORDS.map((key) => {
    const typed = by(`map-${key.replace("_", "-")}`).value.trim(), side = key.split("_")[0];
    return [key, key === side ? typed : named[by(`map-${side}`).value].asText(typed)];
  }));
  // What a map shows depends on where the other parameters are, and not on the start.
  const held = () => {
    const out = { ...shownView.words };
    for (const key of [map.x, map.y, "start", "shown"]) delete out[key];
    return JSON.stringify(out);
  };
  const askMap = () => {
    mapHeld = held();
    mapAsked = mapHeld + JSON.stringify(map);
    bordersAsked = "";
    by("map-notice").hidden = true;
    line.ask({ kind: "map", id: --mapNumber, words: shownView.words, map });
  };
  const askBorders = () => {
    const { shown, ...at } = shownView.words;
    bordersAsked = JSON.stringify(at);
    line.ask({ kind: "borders", id: --mapNumber, words: shownView.words, map });
  };
  const followMap = () => { // after each picture: what of the map is not of this place any more
    if (!map || !line.open) return;
    markHere();
    if (mapAsked !== held() + JSON.stringify(map)) { askMap(); return; }
    const { shown, ...at } = shownView.words;
    if (bordersAsked && bordersAsked !== JSON.stringify(at)) askBorders();
  };
  const mapAway = () => {
    if (recording) return;
    if (mapOf && line.open) line.ask({ kind: "map", id: --mapNumber, words: {}, map: null });
    map = mapOf = null;
    mapAsked = "";
    by("map-box").hidden = by("map-away").hidden = by("map-notice").hidden = true;
  };
  const markHere = () => {
    const { words: at } = shownView;
    fill("here", mapOf ? { x: [mapDrawn("x", +at[mapOf.x.name])], y: [mapDrawn("y", +at[mapOf.y.name])] }
      : { x: [], y: [] });
  };
  const laterMap = () => { mapTimer ||= setTimeout(showMap, 150); };
  const showMap = () => {
    mapTimer = 0;
    const { response, ...corners } = cells;
    fill("cells", { ...corners, colour: response.map((each) => looks[each] ?? REST) });
    const item = (kind) => ([colour, words]) => {
      const entry = document.createElement("li"), swatch = document.createElement("span");
      swatch.className = `swatch ${kind}`;
      swatch.style.background = colour;
      entry.append(swatch, words);
      return entry;
    };
    by("map-legend").replaceChildren(...mapLegend.map(item("")), ...borderLegend.map(item("line")));
  };
  // Of the points that are known, the one nearest on the coarsest grid that has it.
  const responseAt = (i, j) => {
    const { columns, rows } = mapOf;
    for (const stride of [1, 2, 4, 8]) {
      const [row, column] = [Math.round(i / stride) * stride, Math.round(j / stride) * stride];
      const known = row < rows && column < columns && grid[row * columns + column];
      if (known) return known;
    }
    return "not known yet";
  };
  const tellAt = (x, y) => {
    const { columns, rows } = mapOf;
    const response = responseAt(Math.round(mapPart("y", y) * (rows - 1)),
      Math.round(mapPart("x", x) * (columns - 1)));
    const [across, up] = [named[mapOf.x.name].labelled(x), named[mapOf.y.name].labelled(y)];
    by("map-at").textContent = `${across}, ${up}: ${response}`;
  };
  const goToPoint = (x, y) => {
    named[mapOf.x.name].go(x);
    named[mapOf.y.name].go(y);
    want();
  };
  const pointOf = (event) => {
    const view = views.map, area = view.el.getBoundingClientRect();
    const x = view.frame.x_scale.invert(event.clientX - area.left) / named[mapOf.x.name].scale;
    const y = view.frame.y_scale.invert(event.clientY - area.top) / named[mapOf.y.name].scale;
    const inside = [["x", x], ["y", y]].every(([key, value]) => {
      const part = mapPart(key, value);
      return part >= 0 && part <= 1;
    });
    return inside ? [x, y] : null;
  };
  const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const onMapKey = (event) => {
    if (!mapOf) return;
    if (event.key === "Enter" && cursor) goToPoint(...cursor);
    const move = MOVES[event.key];
    if (!move) return;
    event.preventDefault();
    const at = cursor ?? [+shownView.words[mapOf.x.name], +shownView.words[mapOf.y.name]];
    const fast = event.shiftKey ? 8 : 1;
    cursor = ["x", "y"].map((key, k) => {
      const steps = key === "x" ? mapOf.columns - 1 : mapOf.rows - 1;
      const place = Math.round(mapPart(key, at[k]) * steps) + fast * move[k];
      return mapValue(key, Math.min(steps, Math.max(0, place)) / steps);
    });
    fill("cursor", { x: [mapDrawn("x", cursor[0])], y: [mapDrawn("y", cursor[1])] });
    tellAt(...cursor);
  };
  const mapUnits = () => {
    for (const key of ["x", "y"]) by(`map-${key}-unit`).textContent = named[by(`map-${key}`).value]?.unit ?? "";
  };
  const wireMap = () => {
    const place = by("map");
    mapUnits();
    onStillClick(place, (event) => {
      const point = mapOf && pointOf(event);
      if (point) goToPoint(...point);
    });
    place.addEventListener("pointermove", (event) => {
      const point = mapOf && pointOf(event);
      if (point) tellAt(...point);
    });
    place.addEventListener("keydown", onMapKey);
    const again = (chosen) => { map = chosen; if (shownView && line.open) askMap(); };
    for (const key of ["x", "y"]) {
      by(`map-${key}`).addEventListener("change", () => {
        for (const end of ["low", "high"]) by(`map-${key}-${end}`).value = "";
        mapUnits();
        if (map) again(typedMap());
      });
      for (const end of ["low", "high"]) {
        by(`map-${key}-${end}`).addEventListener("change", () => again(typedMap()));
      }
    }
    by("map-here").addEventListener("click", () => again({ x: by("map-x").value, x_low: "", x_high: "",
      y: by("map-y").value, y_low: "", y_high: "" }));
    by("map-away").addEventListener("click", () => {
      mapAway();
      history.replaceState(null, "", address());
    });
  };

  // --- plots ----------------------------------------------------------------------------------
  const unpacked = (data) => Object.fromEntries(Object.entries(data).map(([name, packed]) => {
    const bytes = Uint8Array.from(atob(packed.f4 ?? packed.u2), (c) => c.charCodeAt(0));
    if (packed.u2 === undefined) return [name, new Float32Array(bytes.buffer)];
    return [name, Float32Array.from(new Uint16Array(bytes.buffer),
      (level) => (level === GAP ? NaN : packed.low + packed.step * level))];
  }));
  const joined = (a, b) => {
    const out = new Float32Array(a.length + b.length);
    out.set(a);
    out.set(b, a.length);
    return out;
  };
  const empty = () => ({ omega: new Float32Array(0), x: new Float32Array(0), colour: [], period: [] });
  let stripData = empty(), stripOf = 0, timer = 0;
  const later = () => { // a piece comes every few milliseconds; nobody sees so many pictures
    timer ||= setTimeout(() => { timer = 0; fill("strip", stripData); }, 120);
  };
  let views = {};
  const model = (name) => {
    for (const view of Object.values(views)) {
      const found = view.model.document?.get_model_by_name(name);
      if (found) return found;
    }
    return null;
  };
  const fill = (name, data) => {
    for (const view of Object.values(views)) {
      const source = view.model.document.get_model_by_name(name);
      if (source) source.data = data;
    }
  };
  const draw = (message) => {
    for (const [name, data] of Object.entries(message.data)) {
      const { t, ...lengths } = unpacked(data);
      const drawn = Object.entries(lengths).map(([key, each]) => [key, each.map((x) => x * page.length.scale)]);
      fill(name, { ...(t ? { t } : {}), ...Object.fromEntries(drawn) });
    }
    fill("stops", { at: message.stops.map((x) => x * page.length.scale) });
    const omega = Number(message.words.omega) * named.omega.scale;
    fill("now", { at: [omega] });
    const range = views.strip.model.x_range;
    if (!recording) range.setv({ start: omega * 0.84, end: omega * 1.16 });
    const { unit } = page.length;
    axisLabel(views.portrait.model, "below", message.axes.x + (unit && ` [${unit}]`));
    axisLabel(views.portrait.model, "left", message.axes.v + (unit && ` [${unit}/s]`));
    axisLabel(views.trace.model, "left", message.axes.x + (unit && ` [${unit}]`));
  };
  const axisLabel = (plot, place, text) => {
    const axis = plot[place][0];
    if (axis.axis_label !== text) axis.axis_label = text;
  };
  const onStillClick = (place, action) => { // and not at the end of a drag
    let down = null;
    place.addEventListener("pointerdown", (e) => { down = [e.clientX, e.clientY]; }, true);
    place.addEventListener("pointerup", (e) => {
      if (down && Math.hypot(e.clientX - down[0], e.clientY - down[1]) < 4) action(e);
    }, true);
  };
  const colour = () => {
    const style = getComputedStyle(root);
    const [ink, edge, muted] = ["--ink", "--edge", "--muted"].map((v) => style.getPropertyValue(v).trim());
    for (const view of Object.values(views)) {
      for (const each of view.model.document._all_models.values()) {
        if (each.type.endsWith("Axis")) {
          each.setv({ axis_label_text_color: ink, major_label_text_color: muted,
            axis_line_color: muted, major_tick_line_color: muted, minor_tick_line_color: edge });
        }
        if (each.type === "Grid") each.setv({ grid_line_color: edge, grid_line_alpha: 0.5 });
        if (each.type === "Figure") each.setv({ outline_line_color: edge });
      }
    }
  };
  const goThere = (view, name, event) => {
    const area = view.el.getBoundingClientRect();
    const [across, down] = [event.clientX - area.left, event.clientY - area.top];
    if (!view.frame.bbox.contains(across, down)) return; // but on the tools, or a label
    const x = view.frame.x_scale.invert(across);
    if (!Number.isFinite(x) || x <= 0) return;
    named[name].go(x / named[name].scale);
    want();
  };
  const embed = async () => {
    Bokeh.set_log_level("error");
    for (const [name, item] of Object.entries(page.plots)) {
      const made = await Bokeh.embed.embed_item(item, name);
      views[name] = made.get_by_id?.(item.root_id) ?? [...made][0];
    }
    // A finger on a plot moves the page, until a tool is chosen; and no stop of the Tab key is
    // without a name.
    for (const view of Object.values(views)) {
      view.canvas_view.events_el.tabIndex = -1;
      if (!matchMedia("(pointer: coarse)").matches) continue;
      for (const tool of view.model.toolbar.tools) if (tool.active) tool.active = false;
    }
    const phone = matchMedia("(max-width: 699px)");
    const tools = () => { // on a phone the plot has their room
      for (const view of Object.values(views)) view.model.toolbar_location = phone.matches ? null : "above";
    };
    phone.addEventListener("change", tools);
    tools();
    onStillClick(by("strip"), (event) => goThere(views.strip, "omega", event));
    if (!recording) wireMap();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", colour);
    colour();
    const periods = [1, 2, 3, 4, 5, 6, 7, 8].map((n) => [PERIODS[n], String(n)]);
    by("palette").replaceChildren(...[...periods, [PERIODS[0], "another, or none"],
      [OPEN, `not settled within ${page.settled_within} periods`]].map(([colour, text]) => {
      const item = document.createElement("span");
      const dot = document.createElement("span");
      dot.className = "dot";
      dot.style.background = colour;
      item.append(dot, text);
      return item;
    }));
  };

  // --- the line to the server -----------------------------------------------------------------
  const socket = () => {
    let wire = null, wait = 300;
    const line = {
      open: false,
      ask: (message) => wire.send(JSON.stringify(message)),
    };
    const connect = () => {
      wire = new WebSocket(location.href.replace(/^http/, "ws").replace(/[?#].*$/, "") + "socket");
      wire.onopen = () => {
        line.open = true;
        wait = 300;
        underWay = 0;
        mapAsked = "";
        notice("");
        root.dataset.line = "open";
        settled();
      };
      wire.onmessage = (event) => heard(JSON.parse(event.data));
      wire.onclose = () => {
        line.open = false;
        root.dataset.line = "closed";
        notice("The server does not answer. The page goes on by itself when it is there again.");
        setTimeout(connect, wait);
        wait = Math.min(2 * wait, 4000);
      };
    };
    line.connect = connect;
    return line;
  };

  // --- what is known of certain drive frequencies -----------------------------------------------
  // A recording is at the file's own b, and has no control for another.
  const isShown = ({ omega, b }) => omega !== null && (b === undefined || named.b || b === losses.b);
  const goTo = ({ omega, b }) => {
    named.omega.show(String(omega));
    if (b !== undefined && named.b) named.b.show(String(b));
    want();
  };
  const listed = (name, rows) => document.querySelector(`#${name} ul`).replaceChildren(
    ...rows.map((each) => row(`${each.summary}: ${each.words}`,
      isShown(each) ? ["Show", () => goTo(each)] : null)));
  // Rare losses are of the file's values, with omega and b as its responses have them.
  const isOfLosses = (words) => controls.every(({ name, own }) =>
    name === "omega" || name === "b" || Number(words[name]) === Number(own))
    && losses.rows.some(({ omega, b }) =>
      omega === Number(words.omega) && b === Number(words.b ?? losses.b));
  if (losses) listed("losses", losses.rows);

  // --- the recording, where there is no server --------------------------------------------------
  const recorded = () => ({
    open: true,
    connect() {
      root.dataset.line = "recorded";
      listed("windows", recording.windows);
      listed("yields", recording.yields.rows);
      document.querySelector("#yields p").textContent = recording.yields.words;
      heard({ kind: "strip", ...recording.strip, id: -1 });
      settled();
    },
    ask({ id }) {
      const answer = { id, first: true }, { text } = named.omega;
      const view = recording.views[nearest(Number(text))];
      setTimeout(() => heard(Number(text) > 0
        ? { kind: "view", ...view, ...view.motions[Number(by("shown").value)], start: "", ...answer }
        : { kind: "error", text: `omega: found ${text}; expected a number > 0`, ...answer }));
    },
  });
  const line = recording ? recorded() : socket();

  by("shown").addEventListener("change", want);
  by("follow").addEventListener("change", want);
  by("reset").addEventListener("click", () => {
    start = "";
    by("follow").checked = false;
    for (const c of controls) c.show(c.own);
    want();
  });
  window.addEventListener("popstate", () => { readAddress(); want(); });
  readAddress();
  embed().then(() => line.connect());
})();
