import type { ComponentChildren } from 'preact';
import { useEffect, useState } from 'preact/hooks';

const waiting: (() => void)[] = [];
let running = false;

/** One call after each frame, so that each has its own task with its own layout. */
function next(): void {
  const call = waiting.shift();
  running = call !== undefined;
  if (!call) return;
  call();
  afterFrame(next);
}

/** Frames do not come in a hidden page; then a timer has to do. */
function afterFrame(call: () => void): void {
  let called = false;
  const once = (): void => {
    if (called) return;
    called = true;
    clearTimeout(timer);
    setTimeout(call, 0);
  };
  const timer = setTimeout(once, 100);
  requestAnimationFrame(once);
}

/** Children that are made in a task of their own soon after: a view that opens in parts never blocks the page. */
export function Later({ children }: { children: ComponentChildren }) {
  const [there, setThere] = useState(false);
  useEffect(() => {
    const show = (): void => setThere(true);
    waiting.push(show);
    if (!running) {
      running = true;
      afterFrame(next);
    }
    return () => {
      const at = waiting.indexOf(show);
      if (at >= 0) waiting.splice(at, 1);
    };
  }, []);
  return there ? <>{children}</> : null;
}
