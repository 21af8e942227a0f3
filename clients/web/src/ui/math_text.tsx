import type { ComponentChildren } from 'preact';

// `code`, x^2 and n^(−1/2), and x_k: a subscript follows a single letter, so that names_of_things
// are unchanged.
const marks =
  /`([^`]+)`|\^\(([^)]*)\)|\^([\p{L}\p{N}]+)|(^|[^\p{L}\p{M}\p{N}_])(\p{L}\p{M}*)_([\p{L}\p{N}]+)/gu;

/** Plain text with formula markup, typeset. */
export function MathText({ text }: { text: string }) {
  const parts: ComponentChildren[] = [];
  let end = 0;
  for (const found of text.matchAll(marks)) {
    const [whole, code, group, power, before, letter, index] = found;
    parts.push(text.slice(end, found.index));
    end = found.index + whole.length;
    if (code !== undefined) parts.push(<code>{code}</code>);
    else if (letter !== undefined) parts.push(before, letter, <sub>{index}</sub>);
    else parts.push(<sup>{group ?? power}</sup>);
  }
  return (
    <>
      {parts}
      {text.slice(end)}
    </>
  );
}
