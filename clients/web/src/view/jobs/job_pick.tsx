import { useEffect, useRef, useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { filmOf, isAvailable, isFinal } from '../../api/states';
import { counted, percent } from '../../ui/format';
import { useGrowing } from '../../ui/later';
import { useJobList } from './job_list';
import { sceneTitle, stateLabel } from './job_words';
import { Menu } from '../menu';
import { Thumbnail } from './thumbnail';

const rowsAtOnce = 8;

export const sizeText = (job: Job): string =>
  job.spec.film ? `${job.spec.film.width} × ${job.spec.film.height}` : 'meter only';

export const sameSize = (a: Job, b: Job): boolean =>
  filmOf(a).width === filmOf(b).width && filmOf(a).height === filmOf(b).height;

/** Distinguishing parts come first: a narrow list truncates the rest. */
function factsOf(job: Job): string {
  const error = job.error?.relative;
  return [
    isFinal(job.state) ? null : stateLabel(job),
    error == null ? null : percent(error),
    counted(job.progress?.samples_per_pixel?.mean, 'sample'),
    sizeText(job),
    job.id.slice(0, 4),
  ]
    .filter(Boolean)
    .join(', ');
}

/**
 * Selects one of all renders of the server that have an image. job: the selected one, once it is
 * known.
 */
export function JobPick({
  label,
  id,
  job,
  beside,
  onValue,
}: {
  label: string;
  id: string;
  job: Job | null;
  /** The render with which it is compared. */
  beside: Job | null;
  onValue: (id: string) => void;
}) {
  return (
    <div class="pick">
      <span aria-hidden="true">{label}</span>
      <Menu
        class="pick-menu"
        testId={`pick-${label.toLowerCase()}`}
        label={
          <>
            <span class="visually-hidden">{label}: </span>
            <span class="pick-text">
              {job ? `${sceneTitle(job)}, ${factsOf(job)}` : id.slice(0, 8) || 'Choose a render'}
            </span>
          </>
        }
      >
        <Choices chosen={id} beside={beside} onValue={onValue} />
      </Menu>
    </div>
  );
}

function Choices({
  chosen,
  beside,
  onValue,
}: {
  chosen: string;
  beside: Job | null;
  onValue: (id: string) => void;
}) {
  const [text, setText] = useState('');
  const { list, settled, more, load } = useJobList(null, text.trim());
  const search = useRef<HTMLInputElement>(null);
  useEffect(() => search.current?.focus(), []);
  const offered = list.filter((j) => isAvailable(j, 'image') || isAvailable(j, 'meter'));
  const drawn = useGrowing(offered.length, rowsAtOnce);
  return (
    <>
      <input
        ref={search}
        type="search"
        placeholder="Find by name"
        aria-label="Find a render by its name"
        value={text}
        onInput={(e) => setText(e.currentTarget.value)}
      />
      {offered.length === 0 && (
        <p class={settled ? 'hint' : 'hint pulse'} role="status">
          {settled ? 'No render matches.' : 'Loading…'}
        </p>
      )}
      <ul class="pick-list" aria-busy={!settled}>
        {offered.slice(0, drawn).map((j) => (
          <li key={j.id}>
            <button
              type="button"
              data-closes
              aria-current={j.id === chosen}
              onClick={() => onValue(j.id)}
            >
              <Thumbnail job={j} size={96} />
              <span class="pick-words">
                <span>{sceneTitle(j)}</span>
                <span class="dim">
                  {factsOf(j)}
                  {beside && !sameSize(j, beside) && <span class="whole"> (another size)</span>}
                </span>
              </span>
            </button>
          </li>
        ))}
      </ul>
      {more && (
        <button type="button" class="link" onClick={load}>
          Show older renders
        </button>
      )}
    </>
  );
}
