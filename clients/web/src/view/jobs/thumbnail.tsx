import { useEffect, useRef, useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { imageUrl } from '../../api/client';
import { isAvailable, isFinal } from '../../api/states';

const usualSize = 192;

export const thumbnailUrl = (job: Job, size = usualSize, revision = job.revision ?? 0): string =>
  imageUrl(job.id, 'png', { max_size: size, revision });

/**
 * A small image of a job; updated every few seconds while it renders, and shown until the next has
 * arrived.
 */
export function Thumbnail({ job, size = usualSize }: { job: Job; size?: number }) {
  const [revision, setRevision] = useState(job.revision ?? 0);
  const [broken, setBroken] = useState(0);
  const changed = useRef(0);
  const latest = job.revision ?? 0;
  useEffect(() => {
    if (latest === revision) return;
    const wait = isFinal(job.state) ? 0 : Math.max(0, changed.current + 4000 - Date.now());
    const timer = setTimeout(() => {
      changed.current = Date.now();
      setRevision(latest);
    }, wait);
    return () => clearTimeout(timer);
  }, [latest, revision, job.state]);
  const ok = isAvailable(job, 'image') && revision > 0 && broken !== revision;
  return (
    <span class="thumb">
      {ok ? (
        <img
          src={thumbnailUrl(job, size, revision)}
          alt=""
          decoding="async"
          loading="lazy"
          onError={() => setBroken(revision)}
        />
      ) : job.spec.film === null ? (
        <span class="thumb-meter">Light meter</span>
      ) : (
        <span class={`thumb-empty thumb-${job.state}`} />
      )}
      {job.state === 'rendering' && (
        <i class="thumb-progress" style={{ width: `${100 * (job.progress?.fraction ?? 0)}%` }} />
      )}
    </span>
  );
}
