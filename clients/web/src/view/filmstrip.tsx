import { useGrowing } from '../ui/later';
import { jobs } from '../ui/server_state';
import { useStore } from '../ui/store';
import { sceneTitle, shortState, stateLabel } from './job_words';
import { Thumbnail } from './thumbnail';

const atOnce = 6;

/** The newest jobs as a strip below the image. */
export function Filmstrip({ current }: { current: string | null }) {
  const list = useStore(jobs);
  const drawn = useGrowing(Math.min(24, list?.length ?? 0), atOnce);
  if (!list?.length) return null;
  return (
    <nav class="filmstrip" aria-label="Renders">
      <ol>
        {list.slice(0, Math.min(24, drawn)).map((job) => (
          <li key={job.id}>
            <a
              href={`#/jobs/${job.id}`}
              aria-current={job.id === current ? 'page' : undefined}
              title={`${sceneTitle(job)}, ${stateLabel(job)}`}
            >
              <Thumbnail job={job} />
              <span class="strip-name">{sceneTitle(job)}</span>
              <span class={`strip-state state-text-${job.state}`}>{shortState(job)}</span>
            </a>
          </li>
        ))}
      </ol>
      {list.length > 5 && (
        <a class="strip-all" href="#/jobs">
          All renders
        </a>
      )}
    </nav>
  );
}
