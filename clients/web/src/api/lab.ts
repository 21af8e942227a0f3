import { OfflineError, problemOf, RequestError } from './client';
import type { LabCancelled, LabOutcome, LabPoint, LabRequest } from './types';

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
  let response: Response;
  try {
    response = await fetch('v1/lab/runs', {
      method: 'POST',
      headers: { 'content-type': 'application/json', accept: 'application/x-ndjson' },
      credentials: 'same-origin',
      body: JSON.stringify(request),
      signal,
    });
  } catch (error) {
    if (signal.aborted) throw error;
    throw new OfflineError();
  }
  if (!response.ok) throw new RequestError(await problemOf(response));
  const reader = response.body!.getReader();
  const decoder = new TextDecoder();
  let rest = '';
  let complete = false;
  for (;;) {
    const { done, value } = await reader.read();
    rest += decoder.decode(value, { stream: !done });
    const lines = rest.split('\n');
    rest = lines.pop() ?? '';
    for (const line of lines) {
      const read = JSON.parse(line) as LabPoint | LabOutcome | LabCancelled;
      if ('verdict' in read) {
        complete = true;
        onOutcome(read);
      } else if ('rmse' in read) onPoint(read);
    }
    if (done) break;
  }
  if (!complete) throw new Error('The run was cut off before its end.');
}
