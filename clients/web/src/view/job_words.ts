import type { Job, JobState } from '../api/types';
import { percent } from '../ui/format';
import { models } from './scene_source';

export function sceneTitle(job: Job): string {
  if (job.spec.name) return job.spec.name;
  const { scene } = job.spec;
  if (!/^[0-9a-f]{64}$/.test(scene)) return scene;
  return models.get().find((m) => m.id === scene)?.name || `Model ${scene.slice(0, 8)}`;
}

const labels: Record<JobState, string> = {
  queued: 'In line',
  loading: 'Loading scene',
  rendering: 'Rendering',
  paused: 'Paused',
  finished: 'Finished',
  failed: 'Failed',
  cancelled: 'Cancelled',
};

const reasons: Record<string, string> = {
  samples_per_pixel: 'all samples taken',
  relative_error: 'error reached',
  seconds: 'time is up',
  deadline: 'deadline',
  limit: 'sample limit of the server',
};

export function stateLabel(job: Job): string {
  const reason = job.state === 'finished' && job.stop_reason ? reasons[job.stop_reason] : null;
  return reason ? `${labels[job.state]}: ${reason}` : labels[job.state];
}

export const shortState = (job: Job): string =>
  job.state === 'rendering'
    ? `${Math.floor(100 * (job.progress?.fraction ?? 0))} %`
    : job.state === 'finished'
      ? percent(job.error?.relative_rmse)
      : labels[job.state];
