import { useEffect, useRef, useState } from 'preact/hooks';
import type { Job, JobList as Listed, JobState } from 'tessera-render';
import { api, RequestError } from '../../api/client';
import { jobs, jobsNext, pageSize, sayError } from '../../ui/server_state';
import { useStore } from '../../ui/store';

const typingMs = 250;
const isId = (text: string): boolean => /^[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}$/i.test(text);

type Page = Pick<Listed, 'jobs' | 'next'>;

/** One page of the server's results. A complete id finds that job, whatever its name. */
async function ask(
  states: JobState[] | null,
  text: string,
  cursor: string | null,
  signal: AbortSignal,
): Promise<Page> {
  if (!isId(text)) return api.jobs({ limit: pageSize, cursor, states, name: text }, signal);
  const found = await api.job(text, signal).catch((error) => {
    if (error instanceof RequestError && error.status === 404) return null;
    throw error;
  });
  return { jobs: found && (!states || states.includes(found.state)) ? [found] : [], next: null };
}

interface Pages {
  key: string;
  first: Job[];
  /** Jobs of further pages. */
  rest: Job[];
  next: string | null;
}

/** Puts a newer first page in front of the loaded jobs; those pushed to the next page are kept. */
function renewed(old: Pages, page: Page): Pages {
  if (!old.rest.length) return { ...old, first: page.jobs, next: page.next };
  const there = new Set(page.jobs.map((j) => j.id));
  const known = [...old.first, ...old.rest];
  // Jobs after the last one of the page, in the server's order; those before it that are not on the
  // page no longer exist.
  const last = known.map((j) => there.has(j.id)).lastIndexOf(true);
  const rest = page.next ? known.slice(last + 1) : [];
  return { ...old, first: page.jobs, rest, next: page.next && old.next };
}

/** Adds the next page, which may repeat jobs that the first page pushed out. */
function joined(old: Pages, page: Page): Pages {
  const there = new Set([...old.first, ...old.rest].map((j) => j.id));
  return {
    ...old,
    rest: [...old.rest, ...page.jobs.filter((j) => !there.has(j.id))],
    next: page.next,
  };
}

interface JobList {
  list: Job[];
  /**
   * False until the response to the current query has arrived; until then the list is that of the
   * previous one.
   */
  settled: boolean;
  more: boolean;
  load: () => void;
}

/**
 * Jobs of the server in these states (null: all) whose names contain this text, requested again as
 * they progress.
 */
export function useJobList(states: JobState[] | null, text: string): JobList {
  const newest = useStore(jobs);
  const [pages, setPages] = useState<Pages | null>(null);
  const key = `${states?.join() ?? ''} ${text}`;
  const askedKey = useRef(key);
  const [loading, setLoading] = useState(false);
  useEffect(() => {
    const take = (page: Page): void =>
      setPages((old) =>
        old?.key === key
          ? renewed(old, page)
          : { key, first: page.jobs, rest: [], next: page.next },
      );
    const typed = askedKey.current !== key;
    askedKey.current = key;
    // The page requests all of them anyway.
    if (!states && !text) {
      if (newest) take({ jobs: newest, next: jobsNext.get() });
      return;
    }
    const abort = new AbortController();
    const timer = setTimeout(
      () => {
        ask(states, text, null, abort.signal)
          .then(take)
          .catch((error) => abort.signal.aborted || sayError(error));
      },
      typed ? typingMs : 0,
    );
    return () => {
      clearTimeout(timer);
      abort.abort();
    };
  }, [key, newest]);
  const next = pages?.key === key ? pages.next : null;
  const load = (): void => {
    if (!next || loading) return;
    setLoading(true);
    ask(states, text, next, new AbortController().signal)
      .then((page) => setPages((old) => (old?.key === key ? joined(old, page) : old)))
      .catch(sayError)
      .finally(() => setLoading(false));
  };
  return {
    list: pages ? [...pages.first, ...pages.rest] : [],
    settled: pages?.key === key,
    more: next !== null,
    load,
  };
}
