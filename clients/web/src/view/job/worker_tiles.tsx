import { useEffect, useRef } from 'preact/hooks';
import type { WorkerTile } from 'tessera-render';
import { api } from '../../api/client';

const lookEveryMs = 1000;
/** As in TileFlashes: rectangles need no more pixels. */
const mostWidth = 960;

/** A colour for each worker, the same in all places: the FNV-1a hash of its id as a hue. */
export function workerColour(id: string, opacity = 1): string {
  let hash = 0x811c9dc5;
  for (const c of id) hash = Math.imul(hash ^ c.charCodeAt(0), 0x01000193);
  return `hsl(${(hash >>> 0) % 360} 85% 60% / ${opacity})`;
}

function draw(canvas: HTMLCanvasElement, scale: number, tiles: readonly WorkerTile[]): void {
  const context = canvas.getContext('2d')!;
  context.clearRect(0, 0, canvas.width, canvas.height);
  for (const { worker, x, y, width, height } of tiles) {
    context.fillStyle = workerColour(worker, 0.35);
    context.fillRect(x * scale, y * scale, width * scale, height * scale);
    context.strokeStyle = workerColour(worker);
    const inner = [width * scale - 1, height * scale - 1] as const;
    context.strokeRect(x * scale + 0.5, y * scale + 0.5, ...inner);
  }
}

/** Tiles that workers render now, in the colours of the workers. */
export function WorkerTiles({
  job,
  width,
  height,
}: {
  job: string;
  width: number;
  height: number;
}) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const scale = Math.min(1, mostWidth / width);
  useEffect(() => {
    const leaving = new AbortController();
    const look = async (): Promise<void> => {
      try {
        const { tiles } = await api.workerTiles(job, leaving.signal);
        if (canvas.current) draw(canvas.current, scale, tiles);
      } catch {
        // Other parts of the page report problems of the server.
        if (canvas.current) draw(canvas.current, scale, []);
      }
    };
    void look();
    const timer = setInterval(() => void look(), lookEveryMs);
    return () => {
      clearInterval(timer);
      leaving.abort();
    };
  }, [job, scale]);
  return (
    <canvas
      ref={canvas}
      class="flashes"
      width={Math.ceil(width * scale)}
      height={Math.ceil(height * scale)}
      data-testid="worker-tiles"
      aria-hidden="true"
    />
  );
}
