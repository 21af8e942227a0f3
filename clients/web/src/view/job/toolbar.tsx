import { useEffect, useRef } from 'preact/hooks';
import type { Job } from 'tessera-render';
import type { LiveFilm } from '../../live/film';
import { toneMapLabels, toneMaps, type ToneMap } from '../../live/tone';
import { display, serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';

import { api, imageUrl } from '../../api/client';
import { filmOf } from '../../api/states';
import { DenoiseControls } from './denoised_image';
import { autoExposure } from './film_reading';
import { LightMixer } from './light_mixer';
import { isShare, jobModes, layerModes, planeModes, type Mode } from './view_modes';

interface ToolbarProps {
  job: Job | null;
  mode: Mode;
  film: LiveFilm | null;
  tooLarge: boolean;
  onMode: (mode: Mode) => void;
}

export function Toolbar({ job, mode, film, tooLarge, onMode }: ToolbarProps) {
  const info = useStore(serverInfo);
  const offered = info?.layers;
  const modes = [
    ...(tooLarge ? planeModes.slice(0, 1) : planeModes),
    ...layerModes.filter((m) => !offered || offered.includes(m.mode)),
    ...jobModes(job ? filmOf(job).layers : []),
  ];
  const row = useRef<HTMLFieldSetElement>(null);
  useEffect(() => {
    // If the row is wider than a phone, the selected one may be out of view.
    const { current } = row;
    const chosen = current?.querySelector<HTMLElement>('.mode-on');
    if (!current || !chosen || current.scrollWidth <= current.clientWidth) return;
    current.scrollLeft = chosen.offsetLeft - (current.clientWidth - chosen.offsetWidth) / 2;
  }, [mode, modes.length]);
  return (
    <div class="toolbar">
      <fieldset class="modes" ref={row}>
        <legend class="visually-hidden">View</legend>
        {modes.map((m) => (
          <label key={m.mode} class={mode === m.mode ? 'mode mode-on' : 'mode'} title={m.meaning}>
            <input
              class="visually-hidden"
              type="radio"
              name="mode"
              value={m.mode}
              checked={mode === m.mode}
              data-testid={`view-${m.mode}`}
              onChange={() => onMode(m.mode)}
            />
            {m.label}
          </label>
        ))}
      </fieldset>
      <DenoiseControls job={job} disabled={mode !== 'picture' || tooLarge} />
      {mode !== 'irradiance' && (
        <LightControls
          film={film}
          job={job}
          disabled={mode !== 'picture' && mode !== 'mix' && !isShare(mode)}
        />
      )}
      {job && mode === 'mix' && <LightMixer job={job} />}
    </div>
  );
}

/** The server's automatic exposure of a job; null while it has no sample. */
async function serversExposure(id: string): Promise<number | null> {
  const path = imageUrl(id, 'png', { exposure: 'auto', max_size: 1 });
  const answer = await api.send(path).catch(() => null);
  const stops = answer?.headers.get('x-tessera-exposure');
  return stops ? Number(stops) : null;
}

/**
 * Lets the page's exposure follow the film while it is automatic. In the light of a preset it is a
 * reading of that light, which only the server knows, and which stays the same.
 */
export function useAutoExposure(film: LiveFilm | null, job: Job | null = null): void {
  const { auto } = useStore(display);
  const lit = job?.spec.environment?.preset ? job.id : null;
  useEffect(() => {
    if (!film || auto === false) return;
    let gone = false;
    let ofLight: number | null = null;
    const read = async (): Promise<void> => {
      if (lit) ofLight ??= await serversExposure(lit);
      const exposure = lit ? ofLight : autoExposure(film);
      const shown = display.get();
      if (!gone && exposure !== null && exposure !== shown.exposure)
        display.set({ ...shown, exposure });
    };
    void read();
    let seen = film.version;
    const timer = setInterval(
      () => film.version !== seen && ((seen = film.version), void read()),
      500,
    );
    return () => {
      gone = true;
      clearInterval(timer);
    };
  }, [film, auto, lit]);
}

/** Exposure and tone curve: applied to the floats in the page, without a request. */
export function LightControls({
  film,
  job,
  disabled,
}: {
  film: LiveFilm | null;
  job?: Job | null;
  disabled: boolean;
}) {
  const shown = useStore(display);
  const set = (patch: Partial<typeof shown>): void => display.set({ ...display.get(), ...patch });
  useAutoExposure(film, job);
  return (
    <div class="light">
      <label class="exposure" title="Exposure in stops; double-click resets">
        <span>Exposure</span>
        <input
          type="range"
          min={-20}
          max={20}
          step={0.1}
          value={shown.exposure}
          disabled={disabled}
          data-testid="exposure"
          aria-valuetext={`${shown.exposure} stops`}
          onInput={(e) => set({ exposure: e.currentTarget.valueAsNumber, auto: false })}
          onDblClick={() => set({ exposure: 0, auto: false })}
        />
        <output class="mono">
          {shown.exposure > 0 ? '+' : ''}
          {shown.exposure.toFixed(1)}
        </output>
      </label>
      <button
        type="button"
        class="quiet small"
        disabled={disabled}
        data-testid="exposure-auto"
        aria-pressed={shown.auto !== false}
        title="The exposure follows the image"
        onClick={() => set({ auto: shown.auto === false })}
      >
        Auto
      </button>
      <label class="tone">
        <span class="visually-hidden">Tone curve</span>
        <select
          value={shown.tone}
          disabled={disabled}
          data-testid="tone"
          onChange={(e) => set({ tone: e.currentTarget.value as ToneMap })}
        >
          {toneMaps.map((t) => (
            <option key={t} value={t}>
              {toneMapLabels[t]}
            </option>
          ))}
        </select>
      </label>
    </div>
  );
}
