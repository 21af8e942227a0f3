const waiting: (() => void)[] = [];
let running = false;

/** True while calls wait for their turn: who has time should leave it to them. */
export const turnsWait = (): boolean => running;

/**
 * One call after each frame, so that each has a task of its own with its own layout: many small
 * changes at once never block the page. Gives a function that takes the call back.
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
