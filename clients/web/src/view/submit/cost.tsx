import { useEffect, useState } from 'preact/hooks';
import type { DryRun } from 'tessera-render';
import { api, explain } from '../../api/client';
import { bytes, duration } from '../../ui/format';
import { serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { check, form, requestOf } from './form_model';

/** Delay after the last change: an estimate takes the server up to half a second. */
const restMs = 900;

type Answer = { estimate: DryRun['estimate'] } | { refused: string };

/**
 * The cost of the render in the form, estimated by a dry run on the server. active: the form is in
 * use; images: number in a series.
 */
export function Cost({ active, images }: { active: boolean; images: number }) {
  const values = useStore(form);
  const info = useStore(serverInfo);
  const [found, setFound] = useState<{ text: string; answer: Answer } | null>(null);
  const text =
    active && info && !check(values).length ? JSON.stringify(requestOf(values, info.options)) : '';
  useEffect(() => {
    if (!text) return;
    const abort = new AbortController();
    const timer = setTimeout(() => {
      api
        .dryRun(JSON.parse(text), abort.signal)
        .then((d): Answer => ({ estimate: d.estimate }))
        .catch((error: unknown): Answer => ({ refused: explain(error) }))
        .then((answer) => abort.signal.aborted || setFound({ text, answer }));
    }, restMs);
    return () => {
      clearTimeout(timer);
      abort.abort();
    };
  }, [text]);
  // Discard an estimate for other settings.
  const answer = found?.text === text ? found.answer : null;
  return (
    <p class="cost hint" role="status" data-testid="cost">
      {!text ? '' : !answer ? 'Estimating…' : words(answer, images)}
    </p>
  );
}

function words(answer: Answer, images: number): string {
  if ('refused' in answer) return `No estimate: ${answer.refused}`;
  const { seconds, seconds_low: low, seconds_high: high, memory_bytes: memory } = answer.estimate;
  const each = images > 1 ? `, ${images} images of ${duration(seconds)}` : '';
  return (
    `About ${duration(seconds * images)} on an idle server ` +
    `(${duration(low * images)} to ${duration(high * images)}${each}), ${bytes(memory)} of memory.`
  );
}
