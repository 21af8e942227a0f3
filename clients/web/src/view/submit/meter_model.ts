import type { JobRequestMeter, JobRequestMeterPlane, SceneBounds } from 'tessera-render';
import { rounded } from '../../ui/format';
import { same } from './request_texts';

type Vec3 = [number, number, number];

/** A horizontal rectangle that faces up; world space, metres. */
export interface LevelPlane {
  left: number;
  right: number;
  back: number;
  front: number;
  height: number;
}

type Rectangle = Pick<JobRequestMeterPlane, 'origin' | 'edge_u' | 'edge_v'>;

/** A plane as the form has it: edges that can be changed, or a rectangle that is kept. */
export interface MeterGrid {
  place: LevelPlane | Rectangle;
  columns: number;
  rows: number;
}

export const isLevel = (place: MeterGrid['place']): place is LevelPlane => 'height' in place;

const rectangleOf = (p: LevelPlane): Rectangle => ({
  origin: [p.left, p.height, p.front],
  edge_u: [rounded(p.right - p.left), 0, 0],
  edge_v: [0, 0, rounded(p.back - p.front)],
});

/** Whether a plane of a form has an area, and faces up if it is level. */
export const hasArea = ({ place }: MeterGrid): boolean =>
  !isLevel(place) || (place.right > place.left && place.front > place.back);

export function planeOf({ place, columns, rows }: MeterGrid): JobRequestMeterPlane {
  return { ...(isLevel(place) ? rectangleOf(place) : place), columns, rows };
}

/** The form's values for a plane; planeOf() of them gives the same plane. */
export function gridOf({ columns, rows, ...rectangle }: JobRequestMeterPlane): MeterGrid {
  const { origin, edge_u: u, edge_v: v } = rectangle;
  const place: LevelPlane = {
    left: origin[0],
    right: rounded(origin[0] + u[0]),
    back: rounded(origin[2] + v[2]),
    front: origin[2],
    height: origin[1],
  };
  const grid = { place, columns, rows };
  return same(rectangleOf(place), { origin, edge_u: u, edge_v: v }) && hasArea(grid)
    ? grid
    : { place: rectangle, columns, rows };
}

/** Height of a desk, and the zone along walls that is not measured (EN 12464-1). */
const deskM = 0.75;
const wallZoneM = 0.5;

/** The greatest distance of points in a grid whose longer side is d metres (EN 12464-1). */
const spacingM = (d: number): number => Math.min(10, 0.2 * 5 ** Math.log10(d));

/** The working plane of a room; small scenes are measured at half their height. */
export function workPlane({ min, max }: SceneBounds): MeterGrid {
  const size = min.map((v, i) => max[i] - v);
  const inset = (axis: number): number => Math.min(wallZoneM, size[axis] / 4);
  const place: LevelPlane = {
    left: rounded(min[0] + inset(0)),
    right: rounded(max[0] - inset(0)),
    back: rounded(min[2] + inset(2)),
    front: rounded(max[2] - inset(2)),
    height: rounded(min[1] + Math.min(deskM, size[1] / 2)),
  };
  const [width, depth] = [place.right - place.left, place.front - place.back];
  const spacing = spacingM(Math.max(width, depth));
  return {
    place,
    columns: Math.max(1, Math.ceil(width / spacing)),
    rows: Math.max(1, Math.ceil(depth / spacing)),
  };
}

type Points = NonNullable<JobRequestMeter['points']>;

const up: Vec3 = [0, 1, 0];

/** A line for each point: its position, and its normal unless it faces up. */
export const textOfPoints = (points: Points): string =>
  points
    .map(({ position, normal }) =>
      [...position, ...(String(normal) === String(up) ? [] : normal)].join(' '),
    )
    .join('\n');

/** The points of such a text; null: a line is neither three nor six numbers. */
export function pointsIn(text: string): Points | null {
  const rows = text
    .split('\n')
    .map((line) => line.split(/[\s,;]+/).filter(Boolean).map(Number))
    .filter((row) => row.length);
  if (!rows.every((row) => [3, 6].includes(row.length) && row.every(Number.isFinite))) return null;
  return rows.map((row) => ({
    position: row.slice(0, 3) as Vec3,
    normal: row.length === 6 ? (row.slice(3) as Vec3) : up,
  }));
}
