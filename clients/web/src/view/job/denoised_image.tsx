import { useEffect, useRef, useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { imageUrl } from '../../api/client';
import { isAvailable, isFinal } from '../../api/states';
import { display, serverInfo } from '../../ui/server_state';
import { Store, useStore } from '../../ui/store';

/** The server's information about the displayed denoised image. */
export interface DenoisedError {
  value: number;
  low: number | null;
  high: number | null;
  denoiser: string;
}

/** Whether the server makes the denoised image of an ended job, which takes seconds. */
const isDenoising = new Store(false);

/** Whether the denoised image is selected and offered. */
export function useDenoised(job: Job | null): boolean {
  const shown = useStore(display);
  const offered = useStore(serverInfo)?.layers;
  const preview = job?.spec.denoise?.preview ?? true;
  return (
    job != null &&
    shown.denoised !== false &&
    (offered?.includes('denoised') ?? false) &&
    job.spec.denoise?.type !== 'none' &&
    (preview || isFinal(job.state))
  );
}

function errorIn(headers: Headers): DenoisedError | null {
  const [value, low, high] = (headers.get('x-tessera-error') ?? '').split(',').map(Number);
  if (!Number.isFinite(value)) return null;
  const known = Number.isFinite(high);
  return {
    value,
    low: known ? low : null,
    high: known ? high : null,
    denoiser: headers.get('x-tessera-denoiser') ?? '',
  };
}

/** Minimum interval of new ones while the job renders. */
const paceMs = 2000;
/** Interval at which the first one is awaited. */
const firstMs = 300;
/** Delay after changes of exposure and tone curve before the image is requested again. */
const restMs = 250;

type DenoiseMode = NonNullable<ReturnType<typeof display.get>['denoiseMode']>;

export const denoiseModes: Record<DenoiseMode, { label: string; meaning: string }> = {
  mixed: {
    label: 'Mixed',
    meaning: 'Denoised; parts that the denoiser would spoil are left as rendered',
  },
  full: { label: 'Full', meaning: 'As the denoiser made it, everywhere' },
};

interface DenoisedImageProps {
  job: Job;
  onError: (error: DenoisedError | null) => void;
}

/** The denoised image from the server, updated as the film grows. */
export function DenoisedImage({ job, onError }: DenoisedImageProps) {
  const look = useStore(display);
  const exposure = look.auto === false ? look.exposure : 'auto';
  const mode = look.denoiseMode ?? 'mixed';
  const [url, setUrl] = useState('');
  const newest = useRef(job);
  newest.current = job;
  const running = !isFinal(job.state);
  useEffect(() => {
    const abort = new AbortController();
    let timer = 0;
    let seen = '';
    let revision = -1;
    const ask = async (): Promise<void> => {
      const now = newest.current;
      const isNew = (now.revision ?? 0) !== revision;
      if (!document.hidden && isAvailable(now, 'denoised') && isNew) {
        isDenoising.set(!running);
        try {
          const query = { denoise: mode, exposure, tonemap: look.tone };
          const response = await fetch(imageUrl(job.id, 'png', query), {
            signal: abort.signal,
            headers: seen ? { 'If-None-Match': seen } : {},
          });
          if (response.ok) {
            seen = response.headers.get('etag') ?? '';
            setUrl(URL.createObjectURL(await response.blob()));
            onError(errorIn(response.headers));
          }
          // Of a deleted job there is never one; other refusals are asked again.
          if (response.ok || [304, 404, 410].includes(response.status))
            revision = now.revision ?? 0;
        } catch {
          if (abort.signal.aborted) return;
        }
        isDenoising.set(false);
      }
      if (running || revision < 0)
        timer = window.setTimeout(() => void ask(), seen ? paceMs : firstMs);
    };
    timer = window.setTimeout(() => void ask(), url ? restMs : 0);
    return () => {
      abort.abort();
      clearTimeout(timer);
      isDenoising.set(false);
    };
  }, [job.id, running, exposure, look.tone, mode]);
  useEffect(() => () => void (url && URL.revokeObjectURL(url)), [url]);
  useEffect(() => () => onError(null), []);
  const from = 100 * (look.split ?? 0);
  return url ? (
    <>
      <img
        class="denoised-image"
        data-testid="denoised"
        src={url}
        alt={`Denoised render of ${job.spec.scene}`}
        style={{ clipPath: `inset(0 0 0 ${from}%)` }}
      />
      {from > 0 && from < 100 && <div class="split-line" style={{ left: `${from}%` }} />}
    </>
  ) : null;
}

/**
 * The switch (off, mixed, full), and the slider that reveals the plain image from the left.
 */
export function DenoiseControls({ job, disabled }: { job: Job | null; disabled: boolean }) {
  const shown = useStore(display);
  const busy = useStore(isDenoising);
  const offered = useStore(serverInfo)?.layers?.includes('denoised') ?? false;
  if (!offered || job?.spec.denoise?.type === 'none') return null;
  const set = (patch: Partial<typeof shown>): void => display.set({ ...display.get(), ...patch });
  const on = shown.denoised !== false;
  return (
    <div class="denoise">
      <label title="Off: the image as rendered">
        <input
          type="checkbox"
          checked={on}
          disabled={disabled}
          data-testid="denoise"
          onChange={(e) => set({ denoised: e.currentTarget.checked })}
        />{' '}
        Denoised
      </label>
      <select
        aria-label="Denoised image"
        title={denoiseModes[shown.denoiseMode ?? 'mixed'].meaning}
        value={shown.denoiseMode ?? 'mixed'}
        disabled={disabled || !on}
        data-testid="denoise-mode"
        onChange={(e) => set({ denoiseMode: e.currentTarget.value as DenoiseMode })}
      >
        {Object.entries(denoiseModes).map(([name, { label }]) => (
          <option key={name} value={name}>
            {label}
          </option>
        ))}
      </select>
      <label title="Plain image to the left, denoised to the right">
        <span class="visually-hidden">Split between plain and denoised</span>
        <input
          type="range"
          min={0}
          max={1}
          step={0.01}
          value={shown.split ?? 0}
          disabled={disabled || !on}
          data-testid="denoise-split"
          aria-valuetext={`plain up to ${Math.round(100 * (shown.split ?? 0))}%`}
          onInput={(e) => set({ split: e.currentTarget.valueAsNumber })}
        />
      </label>
      <span class="denoise-note pulse" role="status" data-testid="denoising">
        {on && busy && 'Denoising…'}
      </span>
    </div>
  );
}
