import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks';
import type { RefObject } from 'preact';

interface Size {
  width: number;
  height: number;
}

export interface Viewport {
  style: Record<string, string>;
  /** Screen pixels per film pixel. */
  scale: number;
  zoomed: boolean;
  reset: () => void;
  /** Film coordinates to those of the box. */
  toBox: (x: number, y: number) => { x: number; y: number };
}

interface Pan {
  zoom: number;
  x: number;
  y: number;
}

const still: Pan = { zoom: 1, x: 0, y: 0 };
const maxScale = 40;

/**
 * Fit, zoom and pan of a film inside a box, by wheel, drag, pinch and keys. A move without a button
 * calls onPoint(x, y, false), a click or an arrow key onPoint(x, y, true).
 */
export function useViewport(
  box: RefObject<HTMLElement>,
  film: Size,
  onPoint: (x: number, y: number, pinned: boolean) => void,
  onLeave: () => void,
  probe: { x: number; y: number; pinned: boolean } | null,
): Viewport {
  const [size, setSize] = useState<Size>({ width: 0, height: 0 });
  const [pan, setPan] = useState<Pan>(still);
  useLayoutEffect(() => {
    const element = box.current!;
    const read = (): void => setSize({ width: element.clientWidth, height: element.clientHeight });
    // Its first call comes before the first paint; reading the size here would force a layout in
    // between.
    const observer = new ResizeObserver(read);
    observer.observe(element);
    return () => observer.disconnect();
  }, []);

  const fit = Math.min(size.width / film.width, size.height / film.height) || 1;
  const scale = fit * pan.zoom;
  const left = size.width / 2 + pan.x - (film.width * scale) / 2;
  const top = size.height / 2 + pan.y - (film.height * scale) / 2;
  const live = useRef({ size, pan, fit, scale, left, top, film, onPoint, onLeave, probe });
  live.current = { size, pan, fit, scale, left, top, film, onPoint, onLeave, probe };

  useEffect(() => attach(box.current!, live, setPan), []);
  useEffect(() => setPan(still), [film.width, film.height]);

  return {
    style: {
      width: `${film.width * scale}px`,
      height: `${film.height * scale}px`,
      transform: `translate(${left}px, ${top}px)`,
    },
    scale,
    zoomed: pan.zoom !== 1 || pan.x !== 0 || pan.y !== 0,
    reset: () => setPan(still),
    toBox: (x, y) => ({ x: left + x * scale, y: top + y * scale }),
  };
}

interface Live {
  size: Size;
  pan: Pan;
  fit: number;
  scale: number;
  left: number;
  top: number;
  film: Size;
  onPoint: (x: number, y: number, pinned: boolean) => void;
  onLeave: () => void;
  probe: { x: number; y: number; pinned: boolean } | null;
}

function attach(
  element: HTMLElement,
  live: { current: Live },
  setPan: (pan: Pan) => void,
): () => void {
  const pointers = new Map<number, { x: number; y: number }>();
  let moved = 0;

  const zoomAt = (factor: number, bx: number, by: number): void => {
    const { pan, size, fit } = live.current;
    const zoom = Math.max(1, Math.min(maxScale / fit, pan.zoom * factor));
    const k = zoom / pan.zoom;
    // The point under the cursor stays where it is.
    const cx = bx - size.width / 2,
      cy = by - size.height / 2;
    setPan(zoom === 1 ? still : { zoom, x: cx - (cx - pan.x) * k, y: cy - (cy - pan.y) * k });
  };
  const inBox = (e: { clientX: number; clientY: number }): { x: number; y: number } => {
    const r = element.getBoundingClientRect();
    return { x: e.clientX - r.left, y: e.clientY - r.top };
  };
  const point = (at: { x: number; y: number }, pinned: boolean): void => {
    const { left, top, scale, film } = live.current;
    const x = Math.floor((at.x - left) / scale),
      y = Math.floor((at.y - top) / scale);
    if (x >= 0 && y >= 0 && x < film.width && y < film.height) live.current.onPoint(x, y, pinned);
    else if (!pinned && !live.current.probe?.pinned) live.current.onLeave();
  };

  const onWheel = (e: WheelEvent): void => {
    const pageScrolls = document.documentElement.scrollHeight > innerHeight + 4;
    if (pageScrolls && !e.ctrlKey && !e.metaKey && live.current.pan.zoom === 1) return;
    e.preventDefault();
    const at = inBox(e);
    zoomAt(Math.exp(-e.deltaY * (e.ctrlKey ? 0.012 : 0.0022)), at.x, at.y);
  };
  const onDown = (e: PointerEvent): void => {
    if ((e.target as Element).closest('button')) return;
    pointers.set(e.pointerId, inBox(e));
    moved = 0;
    element.setPointerCapture(e.pointerId);
  };
  const onMove = (e: PointerEvent): void => {
    const at = inBox(e);
    const before = pointers.get(e.pointerId);
    if (!before) {
      if (!live.current.probe?.pinned) point(at, false);
      return;
    }
    moved += Math.hypot(at.x - before.x, at.y - before.y);
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== e.pointerId)![1];
      zoomAt(
        Math.hypot(at.x - other.x, at.y - other.y) /
          Math.max(1, Math.hypot(before.x - other.x, before.y - other.y)),
        (at.x + other.x) / 2,
        (at.y + other.y) / 2,
      );
    } else if (live.current.pan.zoom > 1) {
      const { pan } = live.current;
      setPan({ ...pan, x: pan.x + at.x - before.x, y: pan.y + at.y - before.y });
    }
    pointers.set(e.pointerId, at);
  };
  const onUp = (e: PointerEvent): void => {
    const was = pointers.delete(e.pointerId);
    if (!was || moved > 5 || e.type === 'pointercancel') return;
    if (live.current.probe?.pinned && !e.shiftKey) {
      const { left, top, scale, probe } = live.current;
      const at = inBox(e);
      if (
        Math.floor((at.x - left) / scale) === probe.x &&
        Math.floor((at.y - top) / scale) === probe.y
      )
        return live.current.onLeave();
    }
    point(inBox(e), true);
  };
  const onOut = (): void => {
    if (!live.current.probe?.pinned) live.current.onLeave();
  };
  const onKey = (e: KeyboardEvent): void => {
    const { probe, film, size } = live.current;
    const step = e.shiftKey ? 10 : 1;
    const moves: Record<string, [number, number]> = {
      ArrowLeft: [-step, 0],
      ArrowRight: [step, 0],
      ArrowUp: [0, -step],
      ArrowDown: [0, step],
    };
    const move = moves[e.key];
    if (move) {
      const from = probe ?? { x: film.width >> 1, y: film.height >> 1 };
      live.current.onPoint(
        Math.max(0, Math.min(film.width - 1, from.x + move[0])),
        Math.max(0, Math.min(film.height - 1, from.y + move[1])),
        true,
      );
    } else if (e.key === '+' || e.key === '=') zoomAt(1.4, size.width / 2, size.height / 2);
    else if (e.key === '-') zoomAt(1 / 1.4, size.width / 2, size.height / 2);
    else if (e.key === '0') setPan(still);
    else if (e.key === 'Escape') live.current.onLeave();
    else return;
    e.preventDefault();
  };

  const listeners: [string, (e: never) => void, AddEventListenerOptions?][] = [
    ['wheel', onWheel, { passive: false }],
    ['pointerdown', onDown],
    ['pointermove', onMove],
    ['pointerup', onUp],
    ['pointercancel', onUp],
    ['pointerleave', onOut],
    ['keydown', onKey],
  ];
  for (const [type, listener, options] of listeners)
    element.addEventListener(type, listener as EventListener, options);
  return () => {
    for (const [type, listener] of listeners)
      element.removeEventListener(type, listener as EventListener);
  };
}
