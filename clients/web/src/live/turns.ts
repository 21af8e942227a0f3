const waiting: (() => void)[] = [];
let running = false;

/** True while calls wait for their turn: work that can wait should yield to them. */
export const turnsWait = (): boolean => running;

/**
 * Runs one call after each frame, so that each has a separate task with its own layout: many small
 * changes at once never block the page. Returns a function that cancels the call.
 */
export function takeTurn(call: () => void): () => void {
  waiting.push(call);
  if (!running) {
    running = true;
    afterFrame(next);
  }
  return () => {
    const at = waiting.indexOf(call);
    if (at >= 0) waiting.splice(at, 1);
  };
}

function next(): void {
  const call = waiting.shift();
  running = call !== undefined;
  if (!call) return;
  try {
    call();
  } finally {
    afterFrame(next);
  }
}

/** A hidden page has no frames; then a timer is used. */
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
