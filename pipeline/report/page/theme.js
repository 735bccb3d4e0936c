"use strict";
// Light or dark colours, by the system's setting or the reader's choice.
(() => {
  const theme = document.getElementById("theme");
  const root = document.documentElement;
  const remember = (value) => { try { value === undefined ? 0 : localStorage.setItem("theme", value); return localStorage.getItem("theme"); } catch { return null; } };
  const show = value => {
    if (value === "light" || value === "dark") root.dataset.theme = value; else delete root.dataset.theme;
    theme.value = value ?? "auto";
  };
  show(remember());
  theme.addEventListener("change", () => { remember(theme.value); show(theme.value); });
})();
