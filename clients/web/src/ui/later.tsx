import type { ComponentChildren } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import { takeTurn } from '../live/turns';

/**
 * Children that are made in a task of their own soon after: a view that opens in parts never blocks
 * the page.
 */
export function Later({ children }: { children: ComponentChildren }) {
  const [there, setThere] = useState(false);
  useEffect(() => takeTurn(() => setThere(true)), []);
  return there ? <>{children}</> : null;
}

/**
 * How many of so many parts are drawn: `step` more in each turn, so that a long list never blocks
 * the page. Another `whole` begins anew.
 */
export function useGrowing(length: number, step: number, whole = ''): number {
  const [grown, setGrown] = useState({ whole, drawn: step });
  const drawn = grown.whole === whole ? grown.drawn : step;
  useEffect(
    () => (drawn < length ? takeTurn(() => setGrown({ whole, drawn: drawn + step })) : undefined),
    [drawn, length, whole],
  );
  return drawn;
}
