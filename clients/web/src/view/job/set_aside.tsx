import { useEffect, useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { isAvailable, isFinal } from '../../api/states';
import { firstLookUrl } from './first_look';

/** Smallest share of the light that is worth a sentence: one part in ten thousand. */
const least = 0.01;

/** The share of the light that a finished image is shown without: its fireflies. */
export function SetAside({ job }: { job: Job }) {
  const [share, setShare] = useState<string | null>(null);
  const isOver = isFinal(job.state) && isAvailable(job, 'image');
  useEffect(() => {
    setShare(null);
    if (!isOver) return undefined;
    const abort = new AbortController();
    fetch(firstLookUrl(job), { method: 'HEAD', signal: abort.signal })
      .then((answer) => answer.ok && setShare(answer.headers.get('x-tessera-set-aside')))
      .catch(() => undefined); // Without an answer there is nothing to say.
    return () => abort.abort();
  }, [job.id, job.revision, isOver]);
  if (!share || !(parseFloat(share) >= least)) return null;
  return (
    <p class="ruler-words" data-testid="set-aside">
      {share} of the light was set aside: single pixels that outshine all around them. EXR files
      keep it.
    </p>
  );
}
