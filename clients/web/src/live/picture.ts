import type { LiveFilm, Rect } from './film';
import { makePainter, type Look, type Painter } from './painter';
import { takeTurn, turnsWait } from './turns';

export type Plane = 'picture' | 'error' | 'tile-error' | 'variance' | 'samples';

/** Half a tile: shorter pieces of work keep the budget better on slow processors. */
const cell = 16;
const frameBudgetMs = 8;
/** Maximum time for which an image waits for other parts of the page. */
const patienceMs = 250;

/**
 * Images with pending work. One paints in each frame, because a changed canvas is copied as a
 * whole.
 */
const due = new Set<Picture>();
let frame = 0;
let paintedAt = 0;

function schedule(picture: Picture): void {
  due.add(picture);
  frame ||= requestAnimationFrame(paintNext);
}

function paintNext(time: number): void {
  frame = 0;
  const [first] = due;
  if (first && !(turnsWait() && time - paintedAt < patienceMs)) {
    paintedAt = time;
    due.delete(first);
    first.paint();
  }
  if (due.size) frame ||= requestAnimationFrame(paintNext);
}

/**
 * Shows one plane of a film on a canvas. Changed tiles wait in a set and are converted to pixels
 * inside animation frames, for at most `frameBudgetMs` each, so that the page never stalls, however
 * many tiles arrive. Each frame converts at least one cell.
 */
export class Picture {
  private painter: Painter | null = null;
  private plane: Plane = 'picture';
  private readonly columns: number;
  private readonly rows: number;
  private readonly urgent = new Set<number>();
  /** Cells whose error window overlaps a changed neighbour. */
  private readonly later = new Set<number>();
  private readonly values = new Float32Array(cell * cell * 4);
  private readonly errors = new Float32Array(cell * cell);
  private readonly unlisten: () => void;
  /** Cancels the pending creation of the painter. */
  private readonly unmade: () => void;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    readonly film: LiveFilm,
    private look: Look,
  ) {
    canvas.width = film.width;
    canvas.height = film.height;
    this.columns = Math.ceil(film.width / cell);
    this.rows = Math.ceil(film.height / cell);
    // Hidden images cost nothing; otherwise several would become visible in one frame.
    canvas.style.visibility = 'hidden';
    this.unlisten = film.onChange((rect) => this.mark(rect));
    // Allocating a large canvas takes time.
    this.unmade = takeTurn(() => this.restore());
  }

  show(plane: Plane, look: Look): void {
    const again = plane !== this.plane || this.painter?.bakesLook;
    this.plane = plane;
    this.look = look;
    if (again) this.markAll();
    this.schedule();
  }

  dispose(): void {
    due.delete(this);
    this.unlisten();
    this.unmade();
    this.painter?.dispose();
  }

  private restore(): void {
    this.painter = makePainter(this.canvas, () => this.restore());
    this.canvas.dataset.painter = this.painter.kind;
    this.markAll();
  }

  private markAll(): void {
    // An empty film shows nothing.
    if (!this.film.tilesSeen) return;
    for (let i = 0; i < this.columns * this.rows; ++i) this.urgent.add(i);
    this.schedule();
  }

  private mark(rect: Rect): void {
    const c0 = Math.floor(rect.x / cell),
      c1 = Math.floor((rect.x + rect.width - 1) / cell);
    const r0 = Math.floor(rect.y / cell),
      r1 = Math.floor((rect.y + rect.height - 1) / cell);
    for (let r = r0; r <= r1; ++r)
      for (let c = c0; c <= c1; ++c) this.urgent.add(r * this.columns + c);
    if (this.plane === 'error') {
      for (let r = Math.max(0, r0 - 1); r <= Math.min(this.rows - 1, r1 + 1); ++r) {
        for (let c = Math.max(0, c0 - 1); c <= Math.min(this.columns - 1, c1 + 1); ++c)
          this.later.add(r * this.columns + c);
      }
    }
    this.schedule();
  }

  private schedule(): void {
    if (this.painter) schedule(this);
  }

  /** Only for the schedule above, in an animation frame. */
  paint(): void {
    const { painter } = this;
    if (!painter) return;
    const until = performance.now() + frameBudgetMs;
    let painted = 0;
    for (const set of [this.urgent, this.later]) {
      for (const index of set) {
        if (painted && performance.now() > until) break;
        set.delete(index);
        this.later.delete(index);
        this.paintCell(index, painter);
        painted += 1;
      }
    }
    painter.draw(this.look);
    this.canvas.style.visibility = '';
    if (this.urgent.size || this.later.size) this.schedule();
  }

  private paintCell(index: number, painter: Painter): void {
    const x = (index % this.columns) * cell,
      y = Math.floor(index / this.columns) * cell;
    const rect = {
      x,
      y,
      width: Math.min(cell, this.film.width - x),
      height: Math.min(cell, this.film.height - y),
    };
    const values =
      rect.width * rect.height === cell * cell
        ? this.values
        : this.values.subarray(0, rect.width * rect.height * 4);
    if (this.plane === 'error') this.film.relativeError(rect, this.errors);
    for (let row = 0, o = 0; row < rect.height; ++row) {
      for (let column = 0; column < rect.width; ++column, ++o)
        this.fill(values, 4 * o, (y + row) * this.film.width + x + column, o);
    }
    painter.upload(rect, values, this.look);
  }

  private fill(values: Float32Array, at: number, pixel: number, inCell: number): void {
    const { film } = this;
    const known = film.samples[pixel] > 0;
    values[at + 3] = known ? 1 : 0;
    if (this.plane === 'picture') {
      for (let c = 0; c < 3; ++c) values[at + c] = film.rgb[3 * pixel + c];
      if (known && film.alpha) values[at + 3] = film.alpha[pixel];
      return;
    }
    const value = this.scalar(pixel, inCell);
    values[at] = value;
    if (Number.isNaN(value)) values[at + 3] = 0;
  }

  private scalar(pixel: number, inCell: number): number {
    const { film } = this;
    switch (this.plane) {
      case 'error':
        return this.errors[inCell];
      case 'tile-error':
        return film.tileError[pixel];
      case 'variance':
        return (
          (film.variance[3 * pixel] + film.variance[3 * pixel + 1] + film.variance[3 * pixel + 2]) /
          3
        );
      default:
        return film.samples[pixel];
    }
  }
}
