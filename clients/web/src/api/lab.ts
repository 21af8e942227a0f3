import type { LabOutcome, LabPoint, LabRequest } from 'tessera-render';
import { api } from './client';

interface Listener {
  onPoint: (point: LabPoint) => void;
  onOutcome: (outcome: LabOutcome) => void;
}

/**
 * Runs an experiment and reports each line as it arrives. Aborting the signal ends the run on the
 * server.
 */
export async function runExperiment(
  request: LabRequest,
  { onPoint, onOutcome }: Listener,
  signal: AbortSignal,
): Promise<void> {
  let complete = false;
  for await (const line of api.lab(request, signal)) {
    if ('verdict' in line) {
      complete = true;
      onOutcome(line);
    } else if ('rmse' in line) onPoint(line);
  }
  if (!complete) throw new Error('The run was cut off before its end.');
}
