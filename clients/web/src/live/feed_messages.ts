import type { Job, Problem, TileFrame, WarningEvent } from 'tessera-render';

export type LinkState =
  | 'connecting'
  | 'live'
  | 'reconnecting'
  | 'overloaded'
  | 'ended'
  | 'gone'
  | 'refused';

/** Planes of a tile: only its mean, or variance and sample count too. */
export type TilePlanes = 'mean' | 'all';

export type ToFeed =
  | { type: 'open'; jobId: string }
  | { type: 'tiles'; planes: TilePlanes | null }
  | { type: 'sleep' }
  | { type: 'taken' }
  | { type: 'wake' }
  | { type: 'close' };

/** The job's members that a `progress` or `state` event changes. */
export type JobPatch = Partial<Job>;

export type FromFeed =
  | { type: 'job'; job: Job }
  | { type: 'patch'; patch: JobPatch }
  | { type: 'warning'; warning: WarningEvent }
  | { type: 'link'; state: LinkState; problem?: Problem }
  | { type: 'tiles'; tiles: TileFrame[] }
  | { type: 'complete' };
