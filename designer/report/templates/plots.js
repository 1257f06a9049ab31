"use strict";
// Pictures that zoom and show values. The static picture stays for paper, and where this fails.
const report = {
  // The text of a packed block of the page: base64 of zlib's form.
  async unpacked(id) {
    const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream);
  },

  // Bokeh, run once. The page's policy knows it by its hash.
  bokeh() {
    this.library ??= this.unpacked("bokeh").then(async (response) => {
      const script = document.createElement("script");
      script.textContent = await response.text();
      document.head.append(script);
      return window.Bokeh;
    });
    return this.library;
  },

  // The plots' documents by name, and the page's variable for each colour that they may have.
  documents() {
    this.stored ??= this.unpacked("plots").then((response) => response.json());
    return this.stored;
  },

  // What fills a plot's data in once it is drawn, by the plot's name; after ``ready``.
  filled: {},
  ready: null,

  colour: (name) =>
    getComputedStyle(document.documentElement).getPropertyValue(`--plot-${name}`).trim(),

  async item(name) {
    const { colours, items } = await this.documents();
    const page = (hex) => (hex in colours ? this.colour(colours[hex]) : hex);
    return JSON.parse(items[name].replace(/(?<=")#[0-9a-f]{6}(?=")/g, page));
  },

  // Draws a plot into an element, in the page's colours, in place of what is there.
  async draw(name, target) {
    const [bokeh, item] = await Promise.all([this.bokeh(), this.item(name)]);
    target.replaceChildren();
    const views = await bokeh.embed.embed_item(item, target);
    const root = [...views][0].model;
    if (matchMedia("(pointer: coarse)").matches)
      for (const model of root.references()) if (model.type === "Toolbar") model.active_drag = null;
    await this.ready;
    this.filled[name]?.(root);
    return root;
  },
};

(() => {
  const figures = [...document.querySelectorAll("[data-plot]")];
  if (!figures.length || !window.DecompressionStream) return;

  async function drawn(figure) {
    let live = figure.querySelector(":scope > .live");
    if (!live) {
      live = document.createElement("div");
      live.className = "live";
      live.setAttribute("role", "group");
      const labels = [...figure.querySelectorAll("svg[aria-label]")].map((svg) => svg.getAttribute("aria-label"));
      live.setAttribute("aria-label", labels.join(" "));
      figure.prepend(live);
    }
    try {
      await report.draw(figure.dataset.plot, live);
      figure.classList.add("drawn");
    } catch (error) {
      live.remove();
      console.error(error);
    }
  }

  const seen = new IntersectionObserver(
    (entries) => {
      for (const { isIntersecting, target } of entries) {
        if (!isIntersecting) continue;
        seen.unobserve(target);
        drawn(target);
      }
    },
    { rootMargin: "300px" },
  );
  for (const figure of figures) seen.observe(figure);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    for (const figure of figures) if (figure.classList.contains("drawn")) drawn(figure);
  });
})();
