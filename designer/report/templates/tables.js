"use strict";
// Tables that sort, filter and copy as CSV. Without this script they read as they stand.
(() => {
  const PREFIXES = { f: 1e-15, p: 1e-12, n: 1e-9, "µ": 1e-6, m: 1e-3, k: 1e3, M: 1e6, G: 1e9 };
  const NUMBER = /^[±<~]?\s*([-−+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)(?:\s*([fpnµmkMG]?)(?:Ω|F|Hz|V|A|s|W|N|m)(?![A-Za-z])|.*)/;
  const FEW = 5;

  const cells = (row) => [...row.cells].map((cell) => cell.textContent.trim());

  // A cell as a number, its unit's prefix applied; NaN where it is none.
  function value(text) {
    const found = NUMBER.exec(text.replaceAll("\u00a0", " "));
    if (!found) return NaN;
    return Number(found[1].replace("−", "-")) * (PREFIXES[found[2]] ?? 1);
  }

  function compared(a, b) {
    const [x, y] = [value(a), value(b)];
    if (Number.isFinite(x) && Number.isFinite(y) && x !== y) return x - y;
    return a.localeCompare(b, "en", { numeric: true });
  }

  // The button of a heading sorts up, then down, then as the report has it.
  function sortable(table, head, column) {
    const body = table.tBodies[0];
    const button = document.createElement("button");
    button.type = "button";
    button.className = "sort";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const next = { none: "ascending", ascending: "descending", descending: "none" };
      const order = next[head.getAttribute("aria-sort") ?? "none"];
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      if (order !== "none") head.setAttribute("aria-sort", order);
      const rows = [...body.rows];
      const text = (row) => row.cells[column].textContent.trim();
      const sign = order === "descending" ? -1 : 1;
      rows.sort((a, b) =>
        (order === "none" ? 0 : sign * compared(text(a), text(b))) || a.dataset.place - b.dataset.place);
      body.append(...rows);
    });
  }

  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

  // The rows that are shown, with their headings.
  function csv(table) {
    const rows = [table.tHead.rows[0], ...table.tBodies[0].rows].filter((row) => !row.hidden);
    return rows.map((row) => cells(row).map(quoted).join(",")).join("\n") + "\n";
  }

  async function copy(text) {
    try {
      await navigator.clipboard.writeText(text);
      return true;
    } catch {
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      const done = document.execCommand("copy");
      area.remove();
      return done;
    }
  }

  function filter(table, words, status) {
    const wanted = words.toLowerCase().split(/\s+/).filter(Boolean);
    const rows = [...table.tBodies[0].rows];
    for (const row of rows) {
      const text = cells(row).join(" ").replaceAll("\u00a0", " ").toLowerCase();
      row.hidden = !wanted.every((word) => text.includes(word));
    }
    const shown = rows.filter((row) => !row.hidden).length;
    status.textContent = wanted.length ? `${shown} of ${rows.length} rows` : "";
  }

  function tools(table, title) {
    const bar = document.createElement("div");
    bar.className = "tools";
    const status = document.createElement("span");
    status.setAttribute("role", "status");
    if (table.tBodies[0].rows.length > FEW) {
      const search = document.createElement("input");
      search.type = "search";
      search.placeholder = "Filter rows";
      search.setAttribute("aria-label", `Filter the rows of: ${title}`);
      search.addEventListener("input", () => filter(table, search.value, status));
      bar.append(search);
    }
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "Copy as CSV";
    button.setAttribute("aria-label", `Copy as CSV: ${title}`);
    button.addEventListener("click", async () => {
      status.textContent = (await copy(csv(table))) ? "Copied." : "The browser does not allow it.";
    });
    bar.append(button, status);
    return bar;
  }

  // The nearest heading before an element.
  function heading(element, headings) {
    let title = document.title;
    for (const each of headings) {
      if (!(each.compareDocumentPosition(element) & Node.DOCUMENT_POSITION_FOLLOWING)) break;
      title = each.textContent.trim();
    }
    return title;
  }

  const headings = document.querySelectorAll("h1, h2, h3, h4");
  for (const box of document.querySelectorAll(".scroll")) {
    const title = heading(box, headings);
    box.tabIndex = 0; // what is wider than the page scrolls by the keyboard too
    box.setAttribute("role", "group");
    box.setAttribute("aria-label", title);
    const table = box.querySelector(":scope > table");
    const rows = table ? [...table.tBodies[0].rows] : [];
    if (rows.length < FEW) continue;
    rows.forEach((row, place) => (row.dataset.place = place));
    [...table.tHead.rows[0].cells].forEach((head, column) => sortable(table, head, column));
    box.before(tools(table, title));
  }

  // A link opens what it leads to.
  function reveal() {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!target) return;
    for (let each = target; each; each = each.parentElement) if (each.tagName === "DETAILS") each.open = true;
    const own = target.querySelector(":scope > details");
    if (own) own.open = true;
    target.scrollIntoView();
  }
  addEventListener("hashchange", reveal);
  addEventListener("click", (event) => {
    // The same link once more changes no hash.
    const link = event.target.closest?.("a[href]");
    if (link && location.hash && link.getAttribute("href") === location.hash) reveal();
  });
  reveal();

  // What is folded is printed open.
  const folded = [...document.querySelectorAll("details")];
  let open = [];
  addEventListener("beforeprint", () => {
    open = folded.map((each) => each.open);
    for (const each of folded) each.open = true;
  });
  addEventListener("afterprint", () => folded.forEach((each, k) => (each.open = open[k])));
})();
