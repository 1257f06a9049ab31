"use strict";
// Each board of the study, called up: its verdicts, its parts, its motion.
report.ready = (async () => {
  const section = document.querySelector("#boards [data-boards]");
  if (!section || !window.DecompressionStream) return;
  const study = await (await report.unpacked("board-data")).json();
  const NONE = "–";

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const wide = (text) => new Uint16Array(bytes(text).buffer);

  // A packed column as numbers; NaN where a value is not known.
  function unpack(column) {
    const codes = column.steps > 255 ? wide(column.codes) : bytes(column.codes);
    const step = (column.high - column.low) / (column.steps - 1);
    return Float64Array.from(codes, (code) => (code === column.steps ? NaN : column.low + step * code));
  }

  for (const response of study.responses) {
    response.kind = wide(response.kind);
    response.radius = unpack(response.radius);
    response.margin = unpack(response.margin).map(Math.exp);
  }
  for (const quantity of study.quantities) quantity.values = unpack(quantity);
  const name = (k) => (study.labels ? study.labels[k] : `${k}`);
  const answer = (response, k) => response.kinds[response.kind[k]] ?? ["not asked", "", ""];

  const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];
  function quantityText(value, unit) {
    if (!Number.isFinite(value)) return NONE;
    const [scale, prefix] = PREFIXES.find(([size]) => Math.abs(value) >= size) ?? [1, ""];
    return `${Number((value / scale).toPrecision(4))}\u00a0${prefix}${unit}`;
  }
  const figure = (value, digits = 3) => (Number.isFinite(value) ? `${Number(value.toPrecision(digits))}` : NONE);

  function element(tag, text = "", attributes = {}) {
    const made = document.createElement(tag);
    made.textContent = text;
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return made;
  }

  function table(columns, rows, label) {
    const box = element("div", "", { class: "scroll", tabindex: "0", role: "group", "aria-label": label });
    const made = element("table");
    const head = made.createTHead().insertRow();
    for (const column of columns) head.append(element("th", column, { scope: "col" }));
    const body = made.createTBody();
    for (const row of rows) {
      const line = body.insertRow();
      for (const cell of row) line.append(element("td", cell, cell.length < 22 ? { class: "short" } : {}));
    }
    box.append(made);
    return box;
  }

  // The controls: a response, a board, and the next that lost the response.
  const bar = element("div", "", { class: "tools" });
  const responses = element("select", "", { "aria-label": "Response" });
  study.responses.forEach((response, k) => responses.append(element("option", response.name, { value: k })));
  const number = element("input", "", { type: "number", min: 0, max: study.samples - 1, value: 0, "aria-label": "Number of the board" });
  const previous = element("button", "Previous lost", { type: "button" });
  const next = element("button", "Next lost", { type: "button" });
  const status = element("span", "", { role: "status" });
  bar.append(responses, number, previous, next, status);
  const shown = element("div");
  const plot = element("div", "", { role: "group" });
  section.replaceChildren(bar, shown, plot);

  function lost(step) {
    const response = study.responses[responses.value];
    for (let tries = 1; tries <= study.samples; tries++) {
      const k = (Number(number.value) + step * tries + study.samples * tries) % study.samples;
      if (answer(response, k)[0] !== "ok" && response.kind[k] !== 65535) return k;
    }
    return null;
  }

  function verdicts(k) {
    return study.responses.map((response) => {
      const [verdict, shows, reason] = answer(response, k);
      const why = reason === shows ? NONE : reason;
      return [response.name, verdict, shows, why, figure(response.radius[k], 4), quantityText(response.margin[k], "V")];
    });
  }

  function parts(k) {
    const rows = study.quantities.map(({ name, unit, nominal, sigma, values }) => {
      const off = values[k] - nominal;
      const share = nominal ? `${figure((100 * off) / nominal)} %` : NONE;
      return [Math.abs(off / sigma), [name, quantityText(values[k], unit), share, figure(off / sigma)]];
    });
    return rows.sort((a, b) => b[0] - a[0]).map((row) => row[1]);
  }

  let drawn = 0;
  async function motion(k, response) {
    const mine = ++drawn;
    const orbit = study.orbits.find((one) => one.sample === k && one.response === response);
    const text = orbit
      ? `Motion of board ${name(k)} (orange) over the nominal response.`
      : `The motion of board ${name(k)} is not stored; the nominal response stands here. Boards whose motion is stored are reached by “next lost”.`;
    plot.setAttribute("aria-label", text);
    shown.querySelector("[data-motion]").textContent = text;
    const places = study.responses[response].plots.map(() => element("div", "", { class: "live" }));
    plot.replaceChildren(...places);
    const roots = await Promise.all(
      study.responses[response].plots.map((one, c) => report.draw(one, places[c])),
    );
    if (mine === drawn && orbit) roots.forEach((root, c) => fill(root, orbit.clearances[c], orbit.periods));
  }

  function fill(root, stored, periods) {
    const [x, v] = ["x", "v"].map((key) => Array.from(unpack(stored[key])));
    const t = x.map((_, i) => (periods * i) / (x.length - 1));
    for (const source of root.references()) if (source.name === "board") source.data = { x, v, t };
  }

  function call(k, response) {
    number.value = k;
    const [verdict, shows, reason] = answer(study.responses[response], k);
    const more = reason && reason !== `to ${shows}` && reason !== shows ? ` (${reason})` : "";
    const repeats = !shows || /^\d/.test(shows);
    const why = `${repeats ? "It shows" : "It shows no n-p-q:"} ${shows || "nothing that was asked"}${more}.`;
    status.textContent = `Board ${name(k)}: ${verdict}`;
    shown.replaceChildren(
      element("h3", `Board ${name(k)}, ${study.responses[response].name}: ${verdict}`),
      element("p", why),
      element("p", "", { class: "soft", "data-motion": "" }),
      table(["response", "verdict", "shows", "why", "largest multiplier", "nearest edge"], verdicts(k), `Verdicts of board ${name(k)}`),
      (() => {
        const folded = element("details", "", { class: "folded" });
        folded.append(element("summary", "What was drawn for it, the farthest from nominal first"));
        folded.append(table(["quantity", "value", "off nominal", "standard deviations"], parts(k), `Parts of board ${name(k)}`));
        return folded;
      })(),
    );
    motion(k, response);
  }

  const again = () => {
    const k = Math.round(Number(number.value));
    if (k >= 0 && k < study.samples) call(k, Number(responses.value));
  };
  const step = (by) => {
    const k = lost(by);
    if (k !== null) call(k, Number(responses.value));
  };
  number.addEventListener("change", again);
  responses.addEventListener("change", again);
  previous.addEventListener("click", () => step(-1));
  next.addEventListener("click", () => step(1));

  // A dot of the picture of all boards calls its board up.
  report.filled.margins = (root) => {
    const columns = { x: [], edge: [], row: [], name: [], verdict: [], board: [], sample: [], response: [], colour: [] };
    study.responses.forEach((response, r) => {
      for (let k = 0; k < study.samples; k++) {
        if (response.kind[k] === 65535) continue;
        const [verdict, shows] = answer(response, k);
        columns.x.push(response.radius[k]);
        columns.edge.push(response.margin[k]);
        columns.row.push(r + 0.6 * ((k * 0.6180339887498949) % 1) - 0.3);
        columns.verdict.push(`${verdict}: ${shows}`);
        columns.name.push(response.name);
        columns.board.push(name(k));
        columns.sample.push(k);
        columns.response.push(r);
        columns.colour.push(report.colour(verdict));
      }
    });
    for (const source of root.references()) {
      if (source.name !== "board") continue;
      source.data = columns;
      source.selected.properties.indices.change.connect(() => {
        const [first] = source.selected.indices;
        if (first === undefined) return;
        responses.value = columns.response[first];
        call(columns.sample[first], columns.response[first]);
        section.scrollIntoView();
      });
    }
  };

  const worst = study.responses
    .map((response, r) => [response.kind.filter((code) => response.kinds[code]?.[0] === "lost").length, r])
    .sort((a, b) => b[0] - a[0])[0][1];
  responses.value = worst;
  const started = new IntersectionObserver((entries) => {
    if (!entries.some((entry) => entry.isIntersecting)) return;
    started.disconnect();
    number.value = study.samples - 1;
    step(1);
    if (!shown.childElementCount) call(0, worst);
  });
  started.observe(section);
})();
