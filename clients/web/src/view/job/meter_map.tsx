import { useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { contourOf } from '../../live/contour';
import { ramps } from '../../live/heat';
import { number } from '../../ui/format';
import { NumberInput } from '../field';
import { LuxLegend } from './legend';
import { luxScale, rampIndex, type LuxScale } from './lux';

type Plane = NonNullable<NonNullable<Job['spec']['meter']>['plane']>;

/** A value of the map: lux at a place. */
export interface MapValue {
  lux: number;
  position: readonly number[];
}

const lengthOf = (v: readonly number[]): number => Math.hypot(...v);
const placeOf = (v: readonly number[]): string => v.map((x) => number(x)).join(', ');

const colourOf = (index: number): string =>
  `rgb(${[...ramps.error.subarray(4 * index, 4 * index + 3)].join(' ')})`;

const levelsOf = ({ top, parts }: LuxScale): number[] =>
  Array.from({ length: parts - 1 }, (_, i) => ((i + 1) / parts) * top);

interface MeterMapProps {
  plane: Plane;
  /** Those of single points, if any, followed by those of the plane. */
  values: MapValue[];
  /** What the values are: "Illuminance." */
  meaning?: string;
}

/** The cells of the meter's plane in false colours with contour lines, seen from its lit side. */
export function MeterMap({ plane, values, meaning = 'Illuminance.' }: MeterMapProps) {
  const { columns, rows, origin, edge_u, edge_v } = plane;
  const [own, setOwn] = useState(0);
  const cells = values.slice(values.length - columns * rows);
  const lux = cells.map((v) => v.lux);
  const fitted = luxScale(lux);
  const scale = own > 0 ? { ...fitted, top: own, parts: 4 } : fitted;
  const [width, height] = [lengthOf(edge_u) / columns, lengthOf(edge_v) / rows];
  // Seen from the side to which edge_u x edge_v points, v is up if u is to the right.
  const up = (row: number): number => (rows - row) * height;
  const lines = levelsOf(scale).flatMap((level) => contourOf(lux, columns, rows, level));
  return (
    <figure class="meter-map" data-testid="meter-map">
      <svg
        viewBox={`0 0 ${width * columns} ${height * rows}`}
        role="img"
        aria-label={`${meaning} ${columns} by ${rows} points, in false colours`}
      >
        {cells.map((v, i) => (
          <rect
            key={i}
            x={(i % columns) * width}
            y={up(Math.floor(i / columns) + 1)}
            width={width}
            height={height}
            shape-rendering="crispEdges"
            fill={colourOf(rampIndex(v.lux, scale))}
          >
            <title>{`${number(v.lux)} lux at ${placeOf(v.position)}`}</title>
          </rect>
        ))}
        <path
          class="meter-contour"
          data-testid="meter-contour"
          d={lines
            .map(([a, b]) => `M${a[0] * width} ${up(a[1])}L${b[0] * width} ${up(b[1])}`)
            .join('')}
        />
      </svg>
      <figcaption class="hint">
        The plane seen from its lit side: origin ({placeOf(origin)}) bottom left, edge_u to the
        right, edge_v up. Lines at the labels of the scale.
      </figcaption>
      <LuxLegend meaning={meaning} scale={scale} values="points" inCard />
      <label class="meter-range">
        Scale to{' '}
        <NumberInput
          data-testid="meter-top"
          aria-label="End of the scale, lux"
          min={0}
          step="any"
          value={scale.top}
          onValue={setOwn}
        />{' '}
        lux
        {own > 0 && (
          <button type="button" class="link" onClick={() => setOwn(0)}>
            Fit
          </button>
        )}
      </label>
    </figure>
  );
}
