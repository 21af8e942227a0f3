import type { Job, JobState } from 'tessera-render';
import type { FeedState } from '../../live/job_feed';
import { doneShare, percent } from '../../ui/format';
import { sceneName } from '../submit/scene_source';

export const sceneTitle = (job: Job): string => job.spec.name || sceneName(job.spec.scene);

const labels: Record<JobState, string> = {
  queued: 'Queued',
  loading: 'Loading scene',
  rendering: 'Rendering',
  paused: 'Paused',
  finished: 'Finished',
  failed: 'Failed',
  cancelled: 'Cancelled',
};

const reasons: Record<string, string> = {
  samples_per_pixel: 'sample count reached',
  relative_error: 'error target reached',
  denoised_error: 'denoised error target reached',
  seconds: 'time limit reached',
  cpu_seconds: 'CPU time limit reached',
  deadline: 'deadline',
  meter_error: 'error target of the meter reached',
  light_not_found: 'bound on missing light reached',
  limit: 'sample limit of the server',
};

export function stateLabel(job: Job): string {
  if (job.pause_reason === 'storage_full') return 'Paused: the disk of the server is full';
  const reason = job.state === 'finished' && job.stop_reason ? reasons[job.stop_reason] : null;
  return reason ? `${labels[job.state]}: ${reason}` : labels[job.state];
}

export const shortState = (job: Job): string =>
  job.state === 'rendering'
    ? doneShare(job.progress?.fraction ?? 0)
    : job.state === 'finished'
      ? percent(job.error?.relative)
      : labels[job.state];

/** Why a job has nothing to show; null if it has, or still may. */
export function absence({ job, link, problem }: FeedState): { title: string; why: string } | null {
  if (job) return null;
  if (link === 'gone')
    return {
      title: 'This render does not exist.',
      why: 'It was deleted, or the link belongs to another server.',
    };
  return link === 'refused'
    ? {
        title: 'You do not have access to this render.',
        why: problem?.detail ?? problem?.title ?? '',
      }
    : null;
}
