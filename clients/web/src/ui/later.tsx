import type { ComponentChildren } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import { takeTurn } from '../live/turns';

/**
 * Children created in a separate task soon after: a view that opens in parts never blocks the page.
 */
export function Later({ children }: { children: ComponentChildren }) {
  const [there, setThere] = useState(false);
  useEffect(() => takeTurn(() => setThere(true)), []);
  return there ? <>{children}</> : null;
}

/**
 * The number of parts to draw: `step` more in each turn, so that a long list never blocks the page.
 * Restarts if `whole` changes.
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
