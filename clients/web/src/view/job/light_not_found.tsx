import { useEffect, useRef } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { counted } from '../../ui/format';
import { display, serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { reuse } from './job_settings';

/** As in TileFlashes: rectangles need no more pixels. */
const mostWidth = 960;
/** Side of a tile in pixels. */
const tileSize = 32;

/** A share as a percentage of two digits. */
const share = (v: number): string => `${Number((100 * v).toPrecision(2))}%`;

/** How much light may be missing, or whose is, and the ways to find it. */
export function LightNotFound({ job }: { job: Job }) {
  const info = useStore(serverInfo);
  const look = useStore(display);
  const light = job.light_not_found;
  if (!light) return null;
  const marked = look.showLacking !== false;
  return (
    <div class="light-not-found">
      <p
        class="ruler-words"
        data-testid="light-not-found"
        title={`${light.particles.toLocaleString('en')} particles from the lights were counted`}
      >
        {light.reason
          ? `${light.reason} ${share(light.detected)} of what the image shows is missing, on ` +
            `${counted(light.tiles, 'tile')}.`
          : light.at_most < 1
            ? `Up to ${share(light.at_most)} of the light may be missing.`
            : 'How much light may be missing is not known: too few particles reach the image.'}
      </p>
      {light.reason && (
        <div class="light-actions">
          {light.integrators.map((integrator) => (
            <button
              key={integrator}
              type="button"
              class="quiet small"
              data-testid={`render-with-${integrator}`}
              onClick={() => void reuse(job, info, { integrator, integratorOptions: {} })}
            >
              Render with {integrator}…
            </button>
          ))}
          <label class="check">
            <input
              type="checkbox"
              data-testid="show-lacking"
              checked={marked}
              onChange={(e) => display.set({ ...look, showLacking: e.currentTarget.checked })}
            />
            Mark the tiles
          </label>
        </div>
      )}
    </div>
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
  const marked = useStore(display).showLacking !== false;
  const lacking = marked ? (job.light_not_found?.lacking ?? []) : [];
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
