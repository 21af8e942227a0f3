import { useEffect, useRef } from 'preact/hooks';
import type { Job } from '../api/types';

/** As in TileFlashes: rectangles need no more pixels. */
const mostWidth = 960;
/** Side of a tile in pixels. */
const tileSize = 32;

/** A share as a percentage of two digits. */
const share = (v: number): string => `${Number((100 * v).toPrecision(2))}%`;

/** How much light may be missing, or whose is. */
export function LightNotFound({ job }: { job: Job }) {
  const light = job.light_not_found;
  if (!light) return null;
  return (
    <p
      class="ruler-words"
      data-testid="light-not-found"
      title={`${light.particles.toLocaleString('en')} particles from the lights were counted`}
    >
      {light.reason
        ? `${light.reason} ${share(light.detected)} of what the image shows is missing, on ` +
          `${light.tiles} tile${light.tiles === 1 ? '' : 's'}.`
        : `Up to ${share(light.at_most)} of the light may be missing.`}
    </p>
  );
}

/** Frames around the tiles that lack light. left, top: corner of the image on the full film. */
export function LackingTiles({
  job,
  width,
  height,
  left = 0,
  top = 0,
}: {
  job: Job;
  width: number;
  height: number;
  left?: number;
  top?: number;
}) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const scale = Math.min(1, mostWidth / width);
  const lacking = job.light_not_found?.lacking ?? [];
  useEffect(() => {
    const context = canvas.current?.getContext('2d');
    if (!context) return;
    context.clearRect(0, 0, context.canvas.width, context.canvas.height);
    context.strokeStyle = 'hsl(45 100% 60%)';
    context.setLineDash([4, 4]);
    const first = { x: Math.floor(left / tileSize), y: Math.floor(top / tileSize) };
    const columns = Math.ceil((left + width) / tileSize) - first.x;
    for (const tile of lacking) {
      const x = Math.max(0, (first.x + (tile % columns)) * tileSize - left);
      const y = Math.max(0, (first.y + Math.floor(tile / columns)) * tileSize - top);
      context.strokeRect(x * scale + 1, y * scale + 1, tileSize * scale - 2, tileSize * scale - 2);
    }
  }, [lacking, scale, left, top, width]);
  if (!lacking.length) return null;
  return (
    <canvas
      ref={canvas}
      class="flashes"
      width={Math.ceil(width * scale)}
      height={Math.ceil(height * scale)}
      data-testid="lacking-tiles"
      aria-hidden="true"
    />
  );
}
