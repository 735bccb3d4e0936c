// Counts on the page, sent as JSON to the page around its frame.
(() => {
  let shift = 0;
  new PerformanceObserver(list => { for (const entry of list.getEntries()) if (!entry.hadRecentInput) shift += entry.value; }).observe({ type: "layout-shift", buffered: true });
  const id = name => document.getElementById(name), texts = query => [...document.querySelectorAll(query)].map(at => at.textContent);
  const height = (from, to) => ((to ? to.getBoundingClientRect().top : document.documentElement.scrollHeight - scrollY) - from.getBoundingClientRect().top) / innerHeight;
  addEventListener("load", () => {
    let waited = 0;
    const count = () => {
      const errors = id("alive-errors");
      errors?.scrollIntoView({ behavior: "instant" });
      if (errors?.textContent === "computing" && waited++ < 400) { setTimeout(count, 100); return; }
      const names = [...document.querySelectorAll(".ledger-row:not([hidden]) .ledger-name")];
      const seen = {
        cut: names.filter(at => at.textContent.includes("…") || at.scrollWidth > at.clientWidth + 1).length,
        rows: names.length, ledger: id("ledger") ? height(id("ledger"), id("story")) : 0,
        story: height(document.body, id("figures")), appendix: height(id("figures"), null), shift,
        wider: document.documentElement.scrollWidth - innerWidth, alive: errors?.textContent ?? "",
        values: Object.fromEntries([...document.querySelectorAll(".ledger-row")].map(row => [row.id.slice(6), row.querySelector(".ledger-value").textContent])),
        sentences: texts("#story p.wide:not(.cite, .meta), .examples li"),
      };
      parent.postMessage(JSON.stringify(seen), "*");
    };
    setTimeout(count, 500);
  });
})();
