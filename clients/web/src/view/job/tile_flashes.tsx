import { useEffect, useRef } from 'preact/hooks';
import type { Rect } from '../../live/film';
import type { JobFeed } from '../../live/job_feed';

const lifeMs = 420;
const most = 160;
/**
 * Outlines need no more pixels than this; clearing and compositing a large canvas would cost more
 * than the image.
 */
const mostWidth = 960;

/** Outlines of tiles that have just arrived, which fade. Idle while no tiles arrive. */
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
  const scale = Math.min(1, mostWidth / width);
  const columns = Math.ceil(width * scale);
  const rows = Math.ceil(height * scale);
  useEffect(() => {
    const context = canvas.current?.getContext('2d');
    if (!context || !active || matchMedia('(prefers-reduced-motion: reduce)').matches) return;
    const recent: { rect: Rect; at: number }[] = [];
    let frame = 0;
    const draw = (now: number): void => {
      frame = 0;
      context.clearRect(0, 0, columns, rows);
      while (recent.length && now - recent[0].at > lifeMs) recent.shift();
      for (const { rect, at } of recent) {
        context.strokeStyle = `rgba(255, 206, 110, ${0.85 * (1 - Math.max(0, now - at) / lifeMs)})`;
        const [x, y] = [rect.x * scale, rect.y * scale];
        context.strokeRect(x + 0.5, y + 0.5, rect.width * scale - 1, rect.height * scale - 1);
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
      context.clearRect(0, 0, columns, rows);
    };
  }, [feed, columns, rows, active]);
  if (!active) return null;
  return <canvas ref={canvas} class="flashes" width={columns} height={rows} aria-hidden="true" />;
}
