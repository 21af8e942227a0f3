/** Contour lines of values on a grid, by marching squares (Lorensen and Cline 1987, in 2D). */

type Point = [number, number];

/** A point between two corners where the value crosses the level. */
const between = (a: Point, b: Point, va: number, vb: number, level: number): Point => {
  const t = (level - va) / (vb - va);
  return [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
};

/**
 * Segments of the line on which linear interpolation between the centres of cells equals `level`,
 * in cells: the centre of the first one is (0.5, 0.5). values: row by row.
 */
export function contourOf(
  values: ArrayLike<number>,
  columns: number,
  rows: number,
  level: number,
): [Point, Point][] {
  const out: [Point, Point][] = [];
  for (let row = 0; row + 1 < rows; ++row)
    for (let column = 0; column + 1 < columns; ++column) {
      const corners: Point[] = [
        [column, row],
        [column + 1, row],
        [column + 1, row + 1],
        [column, row + 1],
      ];
      const at = corners.map(([x, y]) => values[y * columns + x]);
      const places = corners.map(([x, y]): Point => [x + 0.5, y + 0.5]);
      const cuts: Point[] = [];
      for (let i = 0; i < 4; ++i) {
        const j = (i + 1) % 4;
        if (at[i] < level !== at[j] < level)
          cuts.push(between(places[i], places[j], at[i], at[j], level));
      }
      // Of a saddle, whose four edges are all cut, the mean tells which corners are connected:
      // the first and the third, if it is on their side.
      const mean = (at[0] + at[1] + at[2] + at[3]) / 4;
      if (cuts.length === 4 && mean < level !== at[0] < level) cuts.push(cuts.shift()!);
      for (let i = 0; i + 1 < cuts.length; i += 2) out.push([cuts[i], cuts[i + 1]]);
    }
  return out;
}
