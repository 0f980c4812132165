// SPDX-License-Identifier: MIT
// Light and dark: the system's choice, or the viewer's.

import { byId } from "./element.js";

const system = window.matchMedia("(prefers-color-scheme: dark)");

/** What the viewer chose before; a browser that stores nothing forgets it. */
export function remembered(key, otherwise) {
  try {
    return localStorage.getItem(`compbox-${key}`) ?? otherwise;
  } catch {
    return otherwise;
  }
}

export function remember(key, value) {
  try {
    localStorage.setItem(`compbox-${key}`, value);
  } catch {
    // stored nowhere: the choice holds until the page is closed
  }
}

/** Keeps <html data-theme> at light or dark; calls changed() after each change. */
export function followTheme(changed) {
  const choice = byId("theme");
  const apply = () => {
    const dark = choice.value === "dark" || (choice.value === "automatic" && system.matches);
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    changed();
  };
  choice.value = remembered("theme", "automatic");
  if (choice.selectedIndex < 0) choice.value = "automatic";
  choice.addEventListener("change", () => {
    remember("theme", choice.value);
    apply();
  });
  system.addEventListener("change", apply);
  apply();
}
