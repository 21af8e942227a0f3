import type { ComponentChildren } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import { takeTurn } from '../live/turns';

/** Children that are made in a task of their own soon after: a view that opens in parts never blocks the page. */
export function Later({ children }: { children: ComponentChildren }) {
  const [there, setThere] = useState(false);
  useEffect(() => takeTurn(() => setThere(true)), []);
  return there ? <>{children}</> : null;
}
