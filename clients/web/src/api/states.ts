import type { JobState } from './types';

export const isFinal = (state: JobState): boolean =>
  state === 'finished' || state === 'failed' || state === 'cancelled';
