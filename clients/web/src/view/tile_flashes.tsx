import { useEffect, useRef } from 'preact/hooks';
import type { Rect } from '../live/film';
import type { JobFeed } from '../live/job_feed';

const lifeMs = 420;
const most = 160;

/** Outlines that fade where tiles have just arrived. Nothing runs while nothing arrives. */
export function TileFlashes({
  feed,
  width,
  height,
  active,
}: {
  feed: JobFeed;
  width: number;
  height: number;
  active: boolean;
}) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const context = canvas.current?.getContext('2d');
    if (!context || !active || matchMedia('(prefers-reduced-motion: reduce)').matches) return;
    const recent: { rect: Rect; at: number }[] = [];
    let frame = 0;
    const draw = (now: number): void => {
      frame = 0;
      context.clearRect(0, 0, width, height);
      while (recent.length && now - recent[0].at > lifeMs) recent.shift();
      for (const { rect, at } of recent) {
        context.strokeStyle = `rgba(255, 206, 110, ${0.85 * (1 - Math.max(0, now - at) / lifeMs)})`;
        context.strokeRect(rect.x + 1, rect.y + 1, rect.width - 2, rect.height - 2);
      }
      if (recent.length) frame = requestAnimationFrame(draw);
    };
    const stop = feed.onTile((rect) => {
      recent.push({ rect, at: performance.now() });
      if (recent.length > most) recent.shift();
      frame ||= requestAnimationFrame(draw);
    });
    return () => {
      stop();
      cancelAnimationFrame(frame);
      context.clearRect(0, 0, width, height);
    };
  }, [feed, width, height, active]);
  return <canvas ref={canvas} class="flashes" width={width} height={height} aria-hidden="true" />;
}
