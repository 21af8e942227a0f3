import { useEffect, useRef } from 'preact/hooks';
import type { LiveFilm } from '../live/film';
import { toneMapLabels, toneMaps, type ToneMap } from '../live/tone';
import { display, serverInfo } from '../ui/server_state';
import { useStore } from '../ui/store';

import type { Job } from '../api/types';
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
    ...jobModes(job?.spec.film.layers ?? []),
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
          disabled={mode !== 'picture' && mode !== 'mix' && !isShare(mode)}
        />
      )}
      {job && mode === 'mix' && <LightMixer job={job} />}
    </div>
  );
}

/** Exposure and tone curve: applied to the floats in the page, without a request. */
export function LightControls({ film, disabled }: { film: LiveFilm | null; disabled: boolean }) {
  const shown = useStore(display);
  const set = (patch: Partial<typeof shown>): void => display.set({ ...display.get(), ...patch });
  return (
    <div class="light">
      <label class="exposure" title="Exposure in stops; double-click resets">
        <span>Exposure</span>
        <input
          type="range"
          min={-8}
          max={8}
          step={0.1}
          value={shown.exposure}
          disabled={disabled}
          data-testid="exposure"
          aria-valuetext={`${shown.exposure} stops`}
          onInput={(e) => set({ exposure: e.currentTarget.valueAsNumber })}
          onDblClick={() => set({ exposure: 0 })}
        />
        <output class="mono">
          {shown.exposure > 0 ? '+' : ''}
          {shown.exposure.toFixed(1)}
        </output>
      </label>
      {film && (
        <button
          type="button"
          class="quiet small"
          disabled={disabled}
          onClick={() => set({ exposure: autoExposure(film) })}
        >
          Auto
        </button>
      )}
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
