import type { Job, MeterReading } from '../api/types';
import { ramps } from '../live/heat';
import { number } from '../ui/format';
import { LuxLegend } from './legend';
import { luxScale, rampIndex } from './lux';

type Plane = NonNullable<NonNullable<Job['spec']['meter']>['plane']>;

const lengthOf = (v: readonly number[]): number => Math.hypot(...v);
const placeOf = (v: readonly number[]): string => v.map((x) => number(x)).join(', ');

const colourOf = (index: number): string =>
  `rgb(${[...ramps.error.subarray(4 * index, 4 * index + 3)].join(' ')})`;

/** The cells of the meter's plane in false colours, seen from its front. */
export function MeterMap({ plane, readings }: { plane: Plane; readings: MeterReading[] }) {
  const { columns, rows, origin, edge_u, edge_v } = plane;
  // The plane's readings follow those of single points.
  const cells = readings.slice(readings.length - columns * rows);
  const scale = luxScale(cells.map((r) => r.illuminance_lux));
  const [width, height] = [lengthOf(edge_u) / columns, lengthOf(edge_v) / rows];
  // Seen from the side to which edge_u x edge_v points, v is up if u is to the right.
  return (
    <figure class="meter-map" data-testid="meter-map">
      <svg
        viewBox={`0 0 ${width * columns} ${height * rows}`}
        role="img"
        aria-label={`Illuminance of ${columns} by ${rows} points, in false colours`}
        shape-rendering="crispEdges"
      >
        {cells.map((r, i) => (
          <rect
            key={i}
            x={(i % columns) * width}
            y={(rows - 1 - Math.floor(i / columns)) * height}
            width={width}
            height={height}
            fill={colourOf(rampIndex(r.illuminance_lux, scale))}
          >
            <title>{`${number(r.illuminance_lux)} lux at ${placeOf(r.position)}`}</title>
          </rect>
        ))}
      </svg>
      <figcaption class="hint">
        The plane from its front: origin ({placeOf(origin)}) at the bottom left, edge_u to the
        right, edge_v up.
      </figcaption>
      <LuxLegend meaning="Illuminance." scale={scale} values="points" inCard />
    </figure>
  );
}
