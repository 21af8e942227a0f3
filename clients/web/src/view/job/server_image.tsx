import { useEffect, useRef, useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { imageUrl } from '../../api/client';
import { filmOf, isAvailable, isFinal } from '../../api/states';
import { number } from '../../ui/format';
import { display } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { useMix } from './light_mixer';
import { isLayer, isShare, jobModes, layerModes, type Mode } from './view_modes';

/**
 * The newest revision, updated occasionally while the film grows, and immediately if `view`
 * changes.
 */
export function useRevision(job: Job, large: boolean, view: string): number {
  const [revision, setRevision] = useState(job.revision ?? 0);
  const latest = useRef(revision);
  latest.current = job.revision ?? 0;
  const running = !isFinal(job.state);
  useEffect(() => {
    setRevision(latest.current);
    if (!running) return;
    const timer = setInterval(() => setRevision(latest.current), large ? 2000 : 5000);
    return () => clearInterval(timer);
  }, [running, large, view]);
  return revision;
}

interface Shown {
  mode: Mode;
  url: string;
  /** Values shown as black and white, for data layers. */
  range: [number, number] | null;
}

/** The image at an address; the previous one stays until the next has arrived. */
function usePicture(src: string | null, mode: Mode): Shown | 'missing' | null {
  const [shown, setShown] = useState<Shown | 'missing' | null>(null);
  useEffect(() => {
    if (!src) return;
    const abort = new AbortController();
    fetch(src, { signal: abort.signal })
      .then(async (response) => {
        if (!response.ok) return setShown('missing');
        const url = URL.createObjectURL(await response.blob());
        const [low, high] = (response.headers.get('x-tessera-range') ?? '').split(',').map(Number);
        setShown({ mode, url, range: Number.isFinite(high) ? [low, high] : null });
      })
      .catch(() => undefined);
    return () => abort.abort();
  }, [src]);
  const url = shown && shown !== 'missing' ? shown.url : null;
  useEffect(() => () => void (url && URL.revokeObjectURL(url)), [url]);
  return shown;
}

/** Larger images are scaled down by the server. */
export const sideMost = 2048;

const ranges: Partial<Record<Mode, string>> = {
  normal: '-1,1',
  depth: 'auto',
  denoise_bias: 'auto',
  position: 'auto',
};

/**
 * A layer, or an image too large for the page's memory, encoded by the server; updated as the film
 * grows.
 */
export function ServerImage({ job, mode, large }: { job: Job; mode: Mode; large: boolean }) {
  const look = useStore(display);
  const revision = useRevision(job, large, mode);
  const exposure = look.auto === false ? look.exposure : 'auto';
  const light = { exposure, tonemap: look.tone };
  const mix = useMix(job);
  const query = isShare(mode)
    ? { layer: mode, ...light }
    : mode === 'mix'
      ? { mix: mix ?? undefined, ...light }
      : isLayer(mode)
        ? { layer: mode, range: ranges[mode] }
        : light;
  const shown = usePicture(
    isAvailable(job, 'image') && revision && !(mode === 'mix' && mix === null)
      ? imageUrl(job.id, 'png', { ...query, revision, ...(large && { max_size: sideMost }) })
      : null,
    mode,
  );
  if (!revision || !shown) return null;
  if (shown === 'missing') return <p class="stage-note">This layer is not there yet.</p>;
  const modes = [...layerModes, ...jobModes(filmOf(job).layers)];
  const meaning = modes.find((m) => m.mode === mode)?.meaning;
  return (
    <>
      <img
        class="server-image"
        data-layer={shown.mode}
        src={shown.url}
        alt={`${mode} of ${job.spec.scene}`}
      />
      {meaning && (
        <p class="layer-note">
          {meaning}
          {(mode === 'depth' || mode === 'z_depth') && shown.range && (
            <>
              {' '}
              Black is {number(shown.range[0])} m, white {number(shown.range[1])} m.
            </>
          )}
          {mode === 'denoise_bias' && shown.range && (
            <>
              {' '}
              Black is {number(shown.range[0])}, white {number(shown.range[1])}.
            </>
          )}
        </p>
      )}
    </>
  );
}
