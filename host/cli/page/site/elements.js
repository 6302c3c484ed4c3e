// The page's elements, and new ones.

export const element = (id) => document.getElementById(id);

/** A new element with these properties (with a dash: attributes) and children, elements or texts. */
export function make(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.includes("-")) made.setAttribute(name, value);
    else made[name] = value;
  }
  made.append(...children);
  return made;
}
