import { Fragment } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import type { Job, JobState } from 'tessera-render';
import { api } from '../../api/client';
import { isAvailable, isFinal } from '../../api/states';
import { ago, counted, duration, percent } from '../../ui/format';
import { useGrowing } from '../../ui/later';
import { choiceIn, keepChoice, route } from '../../ui/router';
import { jobsDamaged, refresh, sayError, serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { ChosenJobs } from './chosen_jobs';
import { useJobList } from './job_list';
import { sceneTitle, stateLabel } from './job_words';
import { SeriesLinks } from '../series/series_view';
import { Thumbnail } from './thumbnail';

type Filter = 'all' | 'active' | 'finished' | 'other';
const filters: Record<Filter, { label: string; states: JobState[] | null }> = {
  all: { label: 'All', states: null },
  active: { label: 'Active', states: ['queued', 'loading', 'rendering', 'paused'] },
  finished: { label: 'Finished', states: ['finished'] },
  other: { label: 'Failed or cancelled', states: ['failed', 'cancelled'] },
};

const cardsAtOnce = 3;

/** Jobs among the newest whose records are damaged: they can only be deleted. */
function DamagedJobs() {
  const ids = useStore(jobsDamaged);
  const remove = (id: string): void => void api.remove(id).then(refresh).catch(sayError);
  return ids.length === 0 ? null : (
    <ul class="warnings" data-testid="damaged-jobs">
      {ids.map((id) => (
        <li key={id}>
          The stored record of render {id} is damaged: it cannot be shown.{' '}
          <button type="button" class="quiet" onClick={() => remove(id)}>
            Delete
          </button>
        </li>
      ))}
    </ul>
  );
}

export function JobsPage() {
  const at = useStore(route);
  const asked = choiceIn(at, 'show');
  const filter = (Object.keys(filters) as Filter[]).find((f) => f === asked) ?? 'all';
  const [text, setText] = useState(choiceIn(at, 'find'));
  const { list, settled, more, load } = useJobList(filters[filter].states, text.trim());
  const [chosen, setChosen] = useState<Set<string> | null>(null);
  const drawn = useGrowing(list.length, cardsAtOnce);
  const narrowed = filter !== 'all' || text.trim() !== '';
  useEffect(() => void refresh(), []);
  useEffect(() => {
    // Browsers limit how often an address may change, and keys repeat faster.
    const timer = setTimeout(() => {
      if (choiceIn(route.get(), 'find') !== text) keepChoice('find', text);
    }, 300);
    return () => clearTimeout(timer);
  }, [text]);
  return (
    <div class="page">
      <header class="page-head">
        <h1>Renders</h1>
        <fieldset class="modes">
          <legend class="visually-hidden">Show</legend>
          {(Object.keys(filters) as Filter[]).map((f) => (
            <label key={f} class={f === filter ? 'mode mode-on' : 'mode'}>
              <input
                class="visually-hidden"
                type="radio"
                name="filter"
                checked={f === filter}
                onChange={() => keepChoice('show', f === 'all' ? '' : f)}
              />
              {filters[f].label}
            </label>
          ))}
        </fieldset>
        <input
          type="search"
          placeholder="Find by name"
          aria-label="Find by name"
          value={text}
          onInput={(e) => setText(e.currentTarget.value)}
        />
        {!chosen && list.length > 0 && (
          <button
            type="button"
            class="quiet"
            data-testid="choose-many"
            onClick={() => setChosen(new Set())}
          >
            Select
          </button>
        )}
      </header>
      {chosen && (
        <ChosenJobs
          list={list}
          chosen={chosen}
          onChoose={setChosen}
          onDone={() => setChosen(null)}
        />
      )}
      <SeriesLinks />
      <DamagedJobs />
      <p class="visually-hidden" role="status">
        {settled && narrowed && `${list.length}${more ? ' or more' : ''} found`}
      </p>
      {list.length === 0 ? (
        <p class={settled ? 'center-note' : 'center-note pulse'}>
          {!settled
            ? 'Loading…'
            : narrowed
              ? 'No render matches.'
              : 'No renders yet. Choose a scene and press Render.'}
        </p>
      ) : (
        <ul class="job-grid" aria-busy={!settled}>
          {list.slice(0, drawn).map((j) => (
            <JobCard
              key={j.id}
              job={j}
              chosen={chosen && chosen.has(j.id)}
              onChoose={(on) => {
                const next = new Set(chosen);
                if (on) next.add(j.id);
                else next.delete(j.id);
                setChosen(next);
              }}
            />
          ))}
        </ul>
      )}
      {more && (
        <button type="button" class="quiet" onClick={load}>
          Show older renders
        </button>
      )}
    </div>
  );
}

interface JobCardProps {
  job: Job;
  /** Null: none can be selected now. */
  chosen: boolean | null;
  onChoose: (chosen: boolean) => void;
}

function JobCard({ job, chosen, onChoose }: JobCardProps) {
  const most = useStore(serverInfo)?.limits.priority ?? Infinity;
  const raise = (by: number): void => {
    api
      .patch(job.id, { priority: Math.max(-most, Math.min(most, job.spec.priority + by)) })
      .then(() => refresh())
      .catch(sayError);
  };
  const facts = [
    job.error?.relative != null && `${percent(job.error.relative)} error`,
    counted(job.progress?.samples_per_pixel?.mean, 'sample'),
    duration(job.progress?.elapsed_seconds),
    ago(job.created_at),
  ].filter((fact) => fact !== false);
  return (
    <li class={chosen ? 'job-card job-chosen' : 'job-card'}>
      {chosen !== null && (
        <label class="check choose">
          <input
            type="checkbox"
            aria-label={`Select ${sceneTitle(job)}`}
            checked={chosen}
            onChange={(e) => onChoose(e.currentTarget.checked)}
          />
          Select
        </label>
      )}
      <a href={`#/jobs/${job.id}`}>
        <Thumbnail job={job} size={400} />
        <strong>{sceneTitle(job)}</strong>
      </a>
      <p>
        <span class={`state state-${job.state}`}>{stateLabel(job)}</span>
      </p>
      <p class="dim">
        {facts.map((fact, i) => (
          <Fragment key={fact}>
            {i > 0 && ' · '}
            <span class="whole">{fact}</span>
          </Fragment>
        ))}
      </p>
      {isFinal(job.state) && isAvailable(job, 'image') && (
        <p>
          <a
            href={`#/compare/${job.id}`}
            aria-label={`Compare ${sceneTitle(job)} with another render`}
          >
            Compare
          </a>
        </p>
      )}
      {!isFinal(job.state) && (
        <p class="priority">
          <span class="dim">Priority {job.spec.priority ?? 0}</span>
          <button
            type="button"
            class="quiet small"
            aria-label="Lower the priority"
            onClick={() => raise(-10)}
          >
            −
          </button>
          <button
            type="button"
            class="quiet small"
            aria-label="Raise the priority"
            onClick={() => raise(10)}
          >
            +
          </button>
        </p>
      )}
    </li>
  );
}
