import type { Job } from 'tessera-render';

export { isFinal } from 'tessera-render';

type Film = NonNullable<Job['spec']['film']>;

const noFilm: Film = {
  width: 0,
  height: 0,
  crop: null,
  filter: { type: 'box', radius: 0.5 },
  layers: [],
};

/** The film of a job; one without pixels for a job that only measures. */
export const filmOf = (job: Job): Film => job.spec.film ?? noFilm;

/** Whether a part of the job can be requested now: before that the server refuses it. */
export const isAvailable = (job: Job | null, part: Job['available'][number]): boolean =>
  job?.available.includes(part) ?? false;
