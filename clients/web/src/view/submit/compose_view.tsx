import { useEffect, useLayoutEffect, useReducer, useRef, useState } from 'preact/hooks';
import type { RefObject } from 'preact';
import type { Scene } from 'tessera-render';
import { api, RequestError } from '../../api/client';
import { Picture } from '../../live/picture';
import { Preview } from '../../live/preview';
import { Icon } from '../../ui/icons';
import { choiceIn, go, goInstead, keepChoice, route } from '../../ui/router';
import { connection, display, refresh } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { CameraNumbers } from './camera_numbers';
import { CropLayer } from './crop_layer';
import { change, form, requestOf, type FormValues } from './form_model';
import {
  framed,
  fromCamera,
  fromPose,
  nearer,
  poseIn,
  poseOf,
  shifted,
  textOf,
  turned,
  type Orbit,
} from './orbit';
import { chooseScene } from './scene_source';
import { LightControls, useAutoExposure } from '../job/toolbar';
import { lookOf } from '../job/view_modes';

const previewPixels = 384 * 216;
/** Members of a job that a preview sets itself, or that affect only how fast an image converges. */
const elsewhere = [
  'film',
  'stop',
  'name',
  'priority',
  'seed',
  'sampler',
  'light_sampler',
  'adaptive',
  'labels',
  'denoise',
  'meter',
  'motion_seconds',
  'retention_seconds',
];

/** A small film with the aspect ratio of the form. */
function previewSize(width: number, height: number): { width: number; height: number } {
  const scale = Math.min(1, Math.sqrt(previewPixels / (width * height)));
  return {
    width: Math.max(8, Math.round(width * scale)),
    height: Math.max(8, Math.round(height * scale)),
  };
}

interface Start {
  orbit: Orbit;
  /**
   * True if it replaces a camera of the file that cannot be rotated: a camera placed by hand has
   * perspective.
   */
  flat: boolean;
}

/**
 * From the camera selected in the form, else the scene's first. Rejects if the server does not
 * respond.
 */
async function startOf({ scene, camera, width, height }: FormValues): Promise<Start> {
  const info = await api.scene(scene).catch((error: unknown): Scene | null => {
    if (error instanceof RequestError) return null;
    throw error;
  });
  const cameras = info?.cameras ?? [];
  const chosen = cameras.find((c, i) => camera === (c.name || `#${i}`)) ?? cameras[0];
  const bounds = info?.bounds ?? null;
  return {
    orbit: fromCamera(chosen, bounds, width / height) ?? framed(bounds, width / height),
    flat: chosen?.type === 'orthographic',
  };
}

const startAgainMs = 1500;

function useStart(values: FormValues): Start | null {
  const [start, setStart] = useState<Start | null>(null);
  const { scene, camera, width, height } = values;
  useEffect(() => {
    setStart(null);
    let wanted = true;
    let timer = 0;
    const look = (): void =>
      void startOf(form.get()).then(
        (found) => wanted && setStart(found),
        () => wanted && (timer = window.setTimeout(look, startAgainMs)),
      );
    look();
    return () => {
      wanted = false;
      clearTimeout(timer);
    };
  }, [scene, camera, width / height]);
  return start;
}

const addressAfterMs = 300;

/** The form and the address name the same scene and camera: if one changes, the other follows. */
function useAddress(scene: string, values: FormValues): void {
  const linked = choiceIn(useStore(route), 'pose');
  /** A change that went from the form to the address need not be applied again. */
  const written = useRef('');
  useEffect(() => {
    if (form.get().scene !== scene) chooseScene(scene);
  }, [scene]);
  useEffect(() => {
    const pose = linked === written.current ? null : poseIn(linked);
    written.current = '';
    if (pose) change({ pose });
  }, [scene, linked]);
  useEffect(() => {
    // Use current values: an address that changed in the same redraw is already in the form.
    const at = route.get();
    const now = form.get().scene;
    if (at.view === 'compose' && now && now !== at.scene) goInstead(`/compose/${now}`);
  }, [values.scene]);
  const kept = values.pose ? textOf(values.pose) : '';
  useEffect(() => {
    // Browsers limit how often an address may change.
    const timer = setTimeout(() => {
      const at = route.get();
      if (at.view !== 'compose' || at.scene !== values.scene || choiceIn(at, 'pose') === kept)
        return;
      written.current = kept;
      keepChoice('pose', kept);
    }, addressAfterMs);
    return () => clearTimeout(timer);
  }, [kept, values.scene]);
}

const hints = matchMedia('(hover: none)').matches
  ? 'Drag with one finger to orbit, two to pan; pinch to zoom.'
  : 'Drag to orbit, Shift-drag to pan, scroll or pinch to zoom.';

/** The camera belongs to the form while it is placed: the Render button can use it at any time. */
export function ComposeView({ scene }: { scene: string }) {
  const values = useStore(form);
  useAddress(scene, values);
  const start = useStart(values);
  const byHand = values.pose !== null;
  const orbit = values.pose ? fromPose(values.pose) : (start?.orbit ?? null);
  const move = (next: Orbit): void => change({ pose: poseOf(next) });
  const [cropping, setCropping] = useState(false);
  const lit = values.environment !== 'scene' && values.environment !== 'none';
  return (
    <div class="compose">
      <header class="job-header">
        <div class="job-title">
          <h1>Position the camera</h1>
          <p class="dim">
            {cropping
              ? 'Drag over the image to choose the part to render. A click removes the crop.'
              : start?.flat && !byHand
                ? 'The file’s camera is orthographic; a custom view is always perspective.'
                : hints}
          </p>
        </div>
        <div class="job-actions">
          <button
            type="button"
            class="quiet"
            aria-pressed={cropping}
            data-testid="compose-crop"
            onClick={() => setCropping(!cropping)}
          >
            {cropping ? 'Finish crop' : 'Draw a crop'}
          </button>
          <button
            type="button"
            class="quiet"
            disabled={!byHand}
            data-testid="compose-reset"
            onClick={() => change({ pose: null })}
          >
            <Icon name="again" /> Reset view
          </button>
          <button type="button" class="quiet" data-testid="compose-done" onClick={() => go('/')}>
            Done
          </button>
          <button
            type="button"
            class="primary compose-render"
            onClick={() => (document.getElementById('new') as HTMLFormElement).requestSubmit()}
          >
            Render
          </button>
        </div>
      </header>
      <Viewfinder values={values} orbit={orbit} onOrbit={move} cropping={cropping} />
      <div class="toolbar">
        <LightControls film={null} disabled={false} />
        <label class="exposure">
          <span>Field of view</span>
          <input
            type="range"
            min={10}
            max={100}
            step={1}
            value={orbit?.fovDegrees ?? 45}
            disabled={!orbit}
            onInput={(e) => orbit && move({ ...orbit, fovDegrees: e.currentTarget.valueAsNumber })}
          />
          <output class="mono">{Math.round(orbit?.fovDegrees ?? 45)}°</output>
        </label>
        {lit && <EnvironmentSliders values={values} />}
      </div>
      <CameraNumbers values={values} orbit={orbit} />
    </div>
  );
}

/** Range of the strength slider in stops, up and down. */
const strengthStops = 5;

/** Rotates and dims the environment where the effect is visible. */
function EnvironmentSliders({ values: v }: { values: FormValues }) {
  const degrees = ((((v.environmentRotation + 180) % 360) + 360) % 360) - 180;
  return (
    <>
      <label class="exposure">
        <span>Rotation</span>
        <input
          type="range"
          min={-180}
          max={180}
          step={1}
          value={degrees}
          data-testid="environment-rotation"
          onInput={(e) => change({ environmentRotation: e.currentTarget.valueAsNumber })}
        />
        <output class="mono">{Math.round(degrees)}°</output>
      </label>
      <label class="exposure" title="In stops; double-click resets">
        <span>Strength</span>
        <input
          type="range"
          min={-strengthStops}
          max={strengthStops}
          step={0.1}
          value={v.environmentIntensity > 0 ? Math.log2(v.environmentIntensity) : -strengthStops}
          data-testid="environment-strength"
          onInput={(e) =>
            change({
              environmentIntensity: Number((2 ** e.currentTarget.valueAsNumber).toPrecision(3)),
            })
          }
          onDblClick={() => change({ environmentIntensity: 1 })}
        />
        <output class="mono">×{v.environmentIntensity}</output>
      </label>
    </>
  );
}

interface ViewfinderProps {
  values: FormValues;
  /** Null until the start position of a camera placed by hand is known. */
  orbit: Orbit | null;
  onOrbit: (orbit: Orbit) => void;
  cropping: boolean;
}

function Viewfinder({ values, orbit, onOrbit, cropping }: ViewfinderProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const box = useRef<HTMLDivElement>(null);
  const picture = useRef<Picture | null>(null);
  const preview = useRef<Preview | null>(null);
  const [, again] = useReducer<number, void>((n) => n + 1, 0);
  const shown = useStore(display);
  const size = previewSize(values.width, values.height);
  const look = lookOf('picture', shown, {
    variance: { low: 1, high: 2 },
    samples: { low: 1, high: 2 },
  });

  useLayoutEffect(() => {
    preview.current = new Preview(size.width, size.height, () => again());
    picture.current = new Picture(canvas.current!, preview.current.film, look);
    return () => {
      picture.current?.dispose();
      preview.current?.close();
    };
  }, [size.width, size.height]);
  useEffect(() => picture.current?.show('picture', look), [look.exposure, look.tone]);
  useAutoExposure(preview.current?.film ?? null);

  // Every change in the form that affects the image updates the preview. The camera is also that of
  // the render: the file's own until it is rotated.
  const request = requestOf(values);
  for (const key of elsewhere) delete request[key];
  const wish = JSON.stringify(request);
  useLayoutEffect(() => {
    if (values.scene) preview.current?.show(JSON.parse(wish) as Record<string, unknown>);
  }, [wish, size.width, size.height]);
  useOrbitControls(box, orbit, onOrbit);

  const state = preview.current?.state;
  const link = useStore(connection);
  useEffect(() => {
    if (link === 'online') preview.current?.wake();
  }, [link]);
  // The preview is often the first to notice that the server is gone, or back.
  useEffect(() => {
    if ((state === 'waiting' && link === 'online') || (state === 'live' && link === 'offline'))
      void refresh();
  }, [state]);
  return (
    <div
      class="stage stage-orbit"
      ref={box}
      tabIndex={0}
      role="group"
      aria-roledescription="viewfinder"
      aria-label="Preview. Arrow keys orbit, Shift+arrow keys pan, plus and minus zoom."
      style={{ '--aspect': `${values.width} / ${values.height}` }}
    >
      <canvas
        ref={canvas}
        key={`${size.width}x${size.height}`}
        class={`viewfinder${values.background === 'transparent' ? ' film-clear' : ''}`}
        data-testid="picture"
        role="img"
        aria-label="Preview of the scene"
      />
      <CropLayer values={values} drawing={cropping} />
      {state === 'waiting' && (
        <p class="layer-note pulse" role="status">
          {preview.current?.detail || 'Reconnecting…'}
        </p>
      )}
      {(state === 'unavailable' || state === 'failed') && (
        <div class="stage-notice notice-failed" role="alert">
          <strong>
            {state === 'unavailable'
              ? 'This server offers no previews.'
              : 'The preview cannot be made.'}
          </strong>
          <p>{preview.current?.detail}</p>
        </div>
      )}
    </div>
  );
}

function useOrbitControls(
  box: RefObject<HTMLElement>,
  orbit: Orbit | null,
  onOrbit: (orbit: Orbit) => void,
): void {
  const live = useRef({ orbit, onOrbit });
  live.current = { orbit, onOrbit };
  useEffect(() => {
    const element = box.current!;
    const apply = (change: (o: Orbit) => Orbit): void => {
      if (!live.current.orbit) return;
      // Several moves may happen before the next redraw: each builds on the last.
      live.current.orbit = change(live.current.orbit);
      live.current.onOrbit(live.current.orbit);
    };
    const pointers = new Map<number, { x: number; y: number }>();
    const onDown = (e: PointerEvent): void => {
      pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
      element.setPointerCapture(e.pointerId);
    };
    const onMove = (e: PointerEvent): void => {
      const before = pointers.get(e.pointerId);
      if (!before) return;
      const dx = e.clientX - before.x;
      const dy = e.clientY - before.y;
      const height = element.clientHeight;
      if (pointers.size === 2) {
        const other = [...pointers].find(([id]) => id !== e.pointerId)![1];
        const apart = (p: { x: number; y: number }): number =>
          Math.max(1, Math.hypot(p.x - other.x, p.y - other.y));
        const factor = apart({ x: e.clientX, y: e.clientY }) / apart(before);
        apply((o) => shifted(nearer(o, factor), -dx / height / 2, dy / height / 2));
      } else if (e.shiftKey || e.buttons === 2 || e.buttons === 4) {
        apply((o) => shifted(o, -dx / height, dy / height));
      } else {
        apply((o) => turned(o, (-dx / height) * 3, (dy / height) * 3));
      }
      pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
    };
    const onUp = (e: PointerEvent): void => void pointers.delete(e.pointerId);
    const onWheel = (e: WheelEvent): void => {
      e.preventDefault();
      apply((o) => nearer(o, Math.exp(-e.deltaY * 0.0012)));
    };
    const onKey = (e: KeyboardEvent): void => {
      const steps: Record<string, [number, number]> = {
        ArrowLeft: [-1, 0],
        ArrowRight: [1, 0],
        ArrowUp: [0, 1],
        ArrowDown: [0, -1],
      };
      const step = steps[e.key];
      if (step) {
        apply((o) =>
          e.shiftKey
            ? shifted(o, 0.04 * step[0], 0.04 * step[1])
            : turned(o, 0.08 * step[0], 0.08 * step[1]),
        );
      } else if (e.key === '+' || e.key === '=') apply((o) => nearer(o, 1.12));
      else if (e.key === '-') apply((o) => nearer(o, 1 / 1.12));
      else return;
      e.preventDefault();
    };
    const listeners: [string, (e: never) => void, AddEventListenerOptions?][] = [
      ['pointerdown', onDown],
      ['pointermove', onMove],
      ['pointerup', onUp],
      ['pointercancel', onUp],
      ['wheel', onWheel, { passive: false }],
      ['keydown', onKey],
      ['contextmenu', (e: Event) => e.preventDefault()],
    ];
    for (const [type, listener, options] of listeners)
      element.addEventListener(type, listener as EventListener, options);
    return () => {
      for (const [type, listener] of listeners)
        element.removeEventListener(type, listener as EventListener);
    };
  }, []);
}
