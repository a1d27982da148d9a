// Names of animations and families.
const idPattern = /^[a-z0-9][a-z0-9_.-]{0,62}$/;

export const idRule =
  'a-z, 0-9, "_", "." and "-", at most 63 of them, the first one a letter or digit';

export function isId(text: string): boolean {
  return idPattern.test(text);
}

/** The nearest name to a text such as a folder's; empty if nothing is left of it. */
export function toId(text: string): string {
  const plain = text
    .toLowerCase()
    .replace(/[^a-z0-9_.-]+/g, '_')
    .replace(/^[^a-z0-9]+/, '');
  return plain.slice(0, 63).replace(/[_.-]+$/, '');
}

/** The last part of a resource's name. */
export function shortName(name: string): string {
  return name.slice(name.lastIndexOf('/') + 1);
}
