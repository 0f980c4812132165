// SPDX-License-Identifier: MIT
// The page's elements. Nothing here reads markup from a text.

/** in : attributes {name: text}; children: elements and texts. out: a new element. */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

export const byId = id => document.getElementById(id);

/** Changes the text only if it differs: a screen reader repeats what is written again. */
export function show(target, text) {
  if (target.textContent !== text) target.textContent = text;
}

/** out: an array of the children made for `names`, made again only if the names differ from the last time. */
export function remake(target, names, make) {
  const key = JSON.stringify(names);
  if (target.remadeFor !== key) {
    target.remadeFor = key;
    target.made = names.map(make);
    target.replaceChildren(...target.made.map(one => one.root));
  }
  return target.made;
}
