import { useEffect, useRef, useState } from 'preact/hooks';
import type { Scene } from 'tessera-render';
import { api, explain } from '../../api/client';
import { filesOfInput } from '../../api/upload';
import { bytes, counted } from '../../ui/format';
import { Icon } from '../../ui/icons';
import { Later } from '../../ui/later';
import { go, route } from '../../ui/router';
import { connection, refresh, serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { AdvancedFields } from './advanced_fields';
import { Cost } from './cost';
import { EnvironmentField } from './environment_field';
import { Field, NumberField, refusalsAt } from '../field';
import {
  change,
  check,
  form,
  integratorOptions,
  refusals,
  refusalsOf,
  requestOf,
  sizePresets,
  type Output,
} from './form_model';
import { LookPresets } from './look_presets';
import { MeterFields } from './meter_fields';
import { ReusedNote } from './reused_note';
import { SceneGallery } from './scene_gallery';
import {
  chooseScene,
  isModel,
  lightUp,
  models,
  sceneDetails,
  sceneName,
  sendFault,
  sendNote,
  sending,
  take,
} from './scene_source';
import { SeriesFields } from '../series/series_fields';
import { picturesOf, seriesOf } from '../series/series_model';
import { StopField } from './stop_field';

function useSceneDetails(scene: string): Scene | null {
  const details = useStore(sceneDetails);
  useEffect(() => {
    sceneDetails.set(models.get().find((m) => m.id === scene) ?? null);
    if (!scene) return;
    const abort = new AbortController();
    api
      .scene(scene, abort.signal)
      .then((found) => {
        sceneDetails.set(found);
        lightUp(found);
      })
      .catch(() => undefined);
    return () => abort.abort();
  }, [scene]);
  return details;
}

const plural = (n: number, what: string): string | null => (n ? counted(n, what) : null);

function SceneFacts({ details, summary }: { details: Scene | null; summary?: string }) {
  const facts = details
    ? [
        plural(details.triangles, 'triangle'),
        plural(details.materials.length, 'material'),
        plural(details.lights.length, 'light'),
        details.bytes && `${bytes(details.bytes)} in memory`,
      ].filter(Boolean)
    : [];
  return (
    <>
      {summary}
      {facts.length > 0 && <span class="facts">{facts.join(' · ')}</span>}
    </>
  );
}

function ScenePicker() {
  const v = useStore(form);
  const info = useStore(serverInfo);
  const own = useStore(models);
  const at = useStore(route);
  const link = useStore(connection);
  const details = useSceneDetails(v.scene);
  const builtIn = info?.scenes ?? [];
  useEffect(() => {
    if (!form.get().scene && builtIn.length) change({ scene: builtIn[0].name });
  }, [builtIn.length]);
  const cameras = Array.isArray(details?.cameras) ? details.cameras : [];
  const variants = details?.variants ?? [];
  return (
    <>
      <Field
        label="Scene"
        pointers={['/scene']}
        hint={
          <SceneFacts
            details={details}
            summary={builtIn.find((s) => s.name === v.scene)?.summary}
          />
        }
      >
        {(a) => (
          <select
            {...a}
            data-testid="scene"
            value={v.scene}
            onChange={(e) => chooseScene(e.currentTarget.value)}
          >
            {!v.scene && (
              <option value="">
                {link === 'locked' ? 'An access key is needed' : 'Waiting for the server…'}
              </option>
            )}
            <optgroup label="Built in">
              {builtIn.map((s) => (
                <option key={s.name} value={s.name}>
                  {s.name}
                </option>
              ))}
            </optgroup>
            {own.length > 0 && (
              <optgroup label="Your models">
                {own.map((s) => (
                  <option key={s.id} value={s.id}>
                    {sceneName(s.id)}
                  </option>
                ))}
              </optgroup>
            )}
          </select>
        )}
      </Field>
      <SceneGallery />
      <DropZone />
      {v.scene && (
        <Field label="Camera" pointers={['/camera']}>
          {(a) => (
            <select
              {...a}
              value={v.pose ? 'pose' : v.camera}
              onChange={(e) =>
                e.currentTarget.value !== 'pose' &&
                change({ camera: e.currentTarget.value, pose: null })
              }
            >
              {v.pose && <option value="pose">Custom view</option>}
              <option value="">
                {details?.cameras && !cameras.length
                  ? 'Auto-fit to model'
                  : 'The scene’s first camera'}
              </option>
              {cameras.map((c, i) => (
                <option key={i} value={c.name || `#${i}`}>
                  {c.name || `Camera ${i + 1}`}
                </option>
              ))}
            </select>
          )}
        </Field>
      )}
      {v.scene && at.view !== 'compose' && (
        <button
          type="button"
          class="quiet"
          data-testid="compose"
          onClick={() => go(`/compose/${v.scene}`)}
        >
          <Icon name="orbit" /> Position the camera…
        </button>
      )}
      {variants.length > 0 && (
        <Field
          label="Variant"
          pointers={['/variant']}
          hint="This model has several material variants."
        >
          {(a) => (
            <select
              {...a}
              value={v.variant}
              onChange={(e) => change({ variant: e.currentTarget.value })}
            >
              <option value="">Default</option>
              {variants.map((x) => (
                <option key={x} value={x}>
                  {x}
                </option>
              ))}
            </select>
          )}
        </Field>
      )}
    </>
  );
}

function DropZone() {
  const input = useRef<HTMLInputElement>(null);
  const busy = useStore(sending);
  const fault = useStore(sendFault);
  const note = useStore(sendNote);
  return (
    <div class="drop-zone" data-testid="drop">
      <button type="button" class="quiet" disabled={!!busy} onClick={() => input.current?.click()}>
        <Icon name="upload" /> {busy ? `Sending ${busy.what}` : 'Use your own model'}
      </button>
      <input
        ref={input}
        class="visually-hidden"
        type="file"
        multiple
        tabIndex={-1}
        aria-label="Model files"
        data-testid="file"
        accept=".glb,.gltf,.zip,.stl,.obj,.mtl,.ply,.3mf,.bin,.png,.jpg,.jpeg,.webp,.ktx2,.hdr,.exr,.ies"
        onChange={(e) => {
          void take(filesOfInput(e.currentTarget));
          e.currentTarget.value = '';
        }}
      />
      {busy ? (
        <progress max={1} value={busy.share} aria-label={`Sending ${busy.what}`} />
      ) : (
        <p class="hint">
          Drop a .glb, glTF folder, .zip, .stl, .obj, .ply or .3mf anywhere on this page. Add an
          .hdr or .exr to light it; an .ies shows a luminaire in a room.
        </p>
      )}
      {note && (
        <p class="hint" data-testid="left-out">
          {note}
        </p>
      )}
      {fault && (
        <p class="wrong" role="alert">
          {fault}
        </p>
      )}
    </div>
  );
}

function SizeField() {
  const v = useStore(form);
  const preset = sizePresets.findIndex((p) => p.width === v.width && p.height === v.height);
  const [custom, setCustom] = useState(false);
  const info = useStore(serverInfo);
  const free = custom || preset < 0;
  return (
    <>
      <Field label="Size" pointers={free ? [] : ['/film/width', '/film/height', '/film']}>
        {(a) => (
          <select
            {...a}
            data-testid="size"
            value={free ? 'custom' : String(preset)}
            onChange={(e) => {
              const chosen = sizePresets[Number(e.currentTarget.value)];
              setCustom(!chosen);
              if (chosen) change({ width: chosen.width, height: chosen.height });
            }}
          >
            {sizePresets.map((p, i) => (
              <option key={p.label} value={String(i)}>{`${p.label}  ${p.note}`}</option>
            ))}
            <option value="custom">Other…</option>
          </select>
        )}
      </Field>
      {free && (
        <div class="pair">
          <NumberField
            label="Width"
            pointers={['/film/width', '/film']}
            data-testid="width"
            value={v.width}
            min={1}
            max={info?.limits.film_side}
            onValue={(width) => change({ width })}
          />
          <NumberField
            label="Height"
            pointers={['/film/height']}
            data-testid="height"
            value={v.height}
            min={1}
            max={info?.limits.film_side}
            onValue={(height) => change({ height })}
          />
        </div>
      )}
    </>
  );
}

function NameField() {
  const { name } = useStore(form);
  const info = useStore(serverInfo);
  return (
    <Field label="Name" pointers={['/name']}>
      {(a) => (
        <input
          {...a}
          type="text"
          value={name}
          placeholder="Optional"
          maxLength={info?.limits.name_characters}
          onInput={(e) => change({ name: e.currentTarget.value })}
        />
      )}
    </Field>
  );
}

const knownPointers = [
  '/scene',
  '/camera',
  '/variant',
  '/time_seconds',
  '/shutter_seconds',
  '/film',
  '/meter/plane',
  '/meter/points',
  '/stop',
  '/environment',
  '/background',
  '/ground',
  '/integrator/type',
  '/integrator/max_depth',
  '/sampler',
  '/estimator',
  '/light_sampler',
  '/adaptive',
  '/seed',
  '/priority',
  '/name',
  '/matrix',
];

const verbOf: Record<Output, string> = {
  image: 'Render',
  both: 'Render and measure',
  meter: 'Measure',
};

export function SubmitForm() {
  const info = useStore(serverInfo);
  const link = useStore(connection);
  const uploading = useStore(sending);
  const items = useStore(refusals);
  const [busy, setBusy] = useState(false);
  /** The form is in use. */
  const [near, setNear] = useState(false);
  const values = useStore(form);
  const variants = useStore(sceneDetails)?.variants ?? [];
  const pictures = picturesOf(values, variants);
  const shown = [
    ...knownPointers,
    ...integratorOptions(info, values.integrator).map(({ pointer }) => pointer),
  ];
  const general = items.filter((item) => !refusalsAt([item], shown).length);

  const submit = async (event: Event): Promise<void> => {
    event.preventDefault();
    const values = { ...form.get() };
    // A hash is not a useful name in a shared list.
    if (!values.name && isModel(values.scene)) values.name = sceneName(values.scene);
    const faults = check(values);
    refusals.set(faults);
    if (faults.length || busy) return;
    setBusy(true);
    try {
      const request = requestOf(values, info?.options);
      if (pictures > 1) {
        const batch = await api.submitBatch(
          seriesOf({ ...values, name: values.name || sceneName(values.scene) }, variants, request),
        );
        go(`/series/${batch.id}`);
      } else {
        const job = await api.submitRequest(request);
        go(`/jobs/${job.id}`);
      }
      void refresh();
    } catch (error) {
      // In a series the template is the form's request.
      const found = refusalsOf(error).map((r) => ({
        ...r,
        pointer: r.pointer.replace(/^\/template(?=\/)/, ''),
      }));
      refusals.set(found.length ? found : [{ pointer: '', detail: explain(error) }]);
    } finally {
      setBusy(false);
    }
  };

  return (
    <form
      class="submit-form"
      id="new"
      onSubmit={submit}
      onPointerEnter={() => setNear(true)}
      onFocusCapture={() => setNear(true)}
      noValidate
      aria-labelledby="new-title"
    >
      <div class="submit-fields">
        <h2 id="new-title">New render</h2>
        <NameField />
        <ScenePicker />
        <Later>
          <EnvironmentField />
        </Later>
        <Later>
          <MeterFields />
        </Later>
        {values.output !== 'meter' && (
          <Later>
            <SizeField />
          </Later>
        )}
        <Later>
          <StopField />
        </Later>
        <Later>
          <SeriesFields />
        </Later>
        <Later>
          <LookPresets />
        </Later>
        <Later>
          <AdvancedFields info={info} />
        </Later>
        <ReusedNote info={info} />
      </div>
      <div class="submit-bar">
        {general.length > 0 && (
          <p class="wrong" role="alert">
            {general.map((g) => g.detail).join(' ')}
          </p>
        )}
        <button
          class="primary"
          data-testid="submit"
          disabled={busy || !!uploading || link === 'locked'}
          type="submit"
        >
          {busy
            ? 'Submitting…'
            : pictures > 1
              ? `Render ${pictures} images`
              : verbOf[values.output]}
        </button>
        <Cost active={near} images={Math.max(1, pictures)} />
      </div>
    </form>
  );
}
