import type { ErrorEstimate, Job } from 'tessera-render';

export type Bias = ErrorEstimate['bias'];

export const biasOf = (job: Job): Bias => job.error?.bias ?? 'none';

/** The number is of noise alone: the image is biased and was not compared with others. */
export const isNoiseAlone = ({ error }: Job): boolean =>
  error?.relative != null && error.high == null;

/** Samples of a pixel in each replicate; each is a pass with photons of its own. */
export const passesOf = (job: Job): number =>
  Math.floor((job.progress?.samples_per_pixel?.mean ?? 0) / job.spec.sampler.replicates);

/**
 * The radius of the latest pass of progressive photon mapping as a share of the first one; null:
 * another integrator, or no pass yet.
 * Source: Knaus and Zwicker 2011, r_{i+1}² / r_i² = (i + alpha) / (i + 1).
 */
export function radiusShare(job: Job): number | null {
  const { alpha } = job.spec.integrator;
  const passes = passesOf(job);
  if (alpha === undefined || passes < 1) return null;
  let square = 1;
  for (let i = 1; i < passes; ++i) square *= (i + alpha) / (i + 1);
  return Math.sqrt(square);
}
