import { useEffect, useRef, useState } from 'preact/hooks';
import { api, explain } from '../api/client';
import { useGrowing } from '../ui/later';
import { go } from '../ui/router';

type Chapter = (typeof import('*.md'))['default'];

/** In reading order. Each is a separate file, fetched when opened. */
const chapters: { name: string; title: string; load: () => Promise<{ default: Chapter }> }[] = [
  { name: 'start', title: 'Getting started', load: () => import('../guide/start.md') },
  {
    name: 'concepts',
    title: 'What the error bar means',
    load: () => import('../guide/concepts.md'),
  },
  { name: 'api', title: 'API guide', load: () => import('../guide/api.md') },
  { name: 'integrator', title: 'Integrator guide', load: () => import('../guide/integrator.md') },
  { name: 'operations', title: 'Operations', load: () => import('../guide/operations.md') },
  { name: 'course', title: 'Laboratory course', load: () => import('../guide/course.md') },
];

export function GuideView({ chapter, section }: { chapter: string; section: string }) {
  const at = chapter ? chapters.findIndex((c) => c.name === chapter) : 0;
  const chosen = chapters[at];
  const [text, setText] = useState<{ name: string; chapter: Chapter } | null>(null);
  const [failure, setFailure] = useState('');
  useEffect(() => {
    let current = true;
    setFailure('');
    chosen
      ?.load()
      .then((module) => current && setText({ name: chosen.name, chapter: module.default }))
      .catch((error: unknown) => current && setFailure(explain(error)));
    return () => {
      current = false;
    };
  }, [chosen]);
  const shown = text && text.name === chosen?.name ? text.chapter : null;
  const article = useRef<HTMLElement>(null);
  const parts = shown?.parts ?? [];
  const drawn = useGrowing(parts.length, 1, chosen?.name);
  // A section can scroll to the top only if enough follows it.
  const there = !section || drawn >= parts.length;

  const showSection = (): void => {
    const heading = section
      ? article.current?.querySelector<HTMLElement>(`h2[id="${CSS.escape(section)}"]`)
      : article.current?.querySelector<HTMLElement>('h1');
    if (!heading) return;
    if (section) heading.scrollIntoView({ block: 'start' });
    else {
      article.current?.closest('.centre')?.scrollTo(0, 0);
      window.scrollTo(0, 0);
    }
    heading.focus({ preventScroll: true });
  };
  useEffect(() => {
    if (there) showSection();
  }, [shown, section, there]);
  const [refusal, setRefusal] = useState('');
  const renderPair = async (jobs: object[]): Promise<void> => {
    setRefusal('');
    try {
      const made = await Promise.all(jobs.map((job) => api.submitRequest(job)));
      go(`/compare/${made.map((job) => job.id).join('/')}`);
    } catch (error) {
      setRefusal(explain(error));
    }
  };
  const onClick = (event: Event): void => {
    const target = event.target as Element;
    // A link to the current address triggers no event.
    if (target.closest('a')?.getAttribute('href') === location.hash) showSection();
    const pair = target.closest<HTMLElement>('[data-pair]')?.dataset.pair;
    if (pair) void renderPair(JSON.parse(pair) as object[]);
  };

  return (
    <div class="guide" data-testid="guide" onClick={onClick}>
      <nav class="guide-list" aria-label="Chapters">
        <h2>Guide</h2>
        <ol>
          {chapters.map((c) => (
            <li key={c.name}>
              <a href={`#/guide/${c.name}`} aria-current={c === chosen ? 'page' : undefined}>
                {c.title}
              </a>
              {c === chosen && shown && <Sections name={c.name} chapter={shown} at={section} />}
            </li>
          ))}
          <li>
            <a href="docs">API reference</a>
          </li>
        </ol>
        <label class="guide-choice">
          <span class="visually-hidden">Chapter</span>
          <select
            value={chosen?.name ?? ''}
            onChange={(e) => go(`/guide/${e.currentTarget.value}`)}
          >
            {chapters.map((c) => (
              <option key={c.name} value={c.name}>
                {c.title}
              </option>
            ))}
          </select>
        </label>
        {chosen && shown && (
          <details class="guide-choice">
            <summary>In this chapter</summary>
            <Sections name={chosen.name} chapter={shown} at={section} />
          </details>
        )}
      </nav>
      {!chosen ? (
        <div class="center-note">
          <h1>There is no chapter “{chapter}”</h1>
          <p>See the list for available chapters.</p>
        </div>
      ) : failure ? (
        <div class="center-note" role="alert">
          <h1>This chapter could not be loaded</h1>
          <p>{failure}</p>
        </div>
      ) : !shown ? (
        <div class="center-note pulse">Loading…</div>
      ) : (
        <div class="guide-page">
          {refusal && (
            <p class="guide-refusal wrong" role="alert">
              {refusal}
            </p>
          )}
          <article
            class="guide-text"
            data-testid="chapter"
            ref={article}
            aria-busy={drawn < parts.length}
          >
            {parts.slice(0, drawn).map((part) => (
              <Part key={part} html={part} />
            ))}
          </article>
          <Neighbours at={at} />
        </div>
      )}
    </div>
  );
}

function Part({ html }: { html: string }) {
  // Copied commands use this server.
  const local = html.replace(/S=http:\/\/127\.0\.0\.1:8080/g, `S=${location.origin}`);
  return <div dangerouslySetInnerHTML={{ __html: local }} />;
}

function Sections({ name, chapter, at }: { name: string; chapter: Chapter; at: string }) {
  return (
    <ol class="guide-sections">
      {chapter.sections.map((s) => (
        <li key={s.id}>
          <a href={`#/guide/${name}/${s.id}`} aria-current={s.id === at ? 'location' : undefined}>
            {s.title}
          </a>
        </li>
      ))}
    </ol>
  );
}

function Neighbours({ at }: { at: number }) {
  const before = chapters[at - 1];
  const after = chapters[at + 1];
  return (
    <nav class="guide-neighbours" aria-label="Neighbouring chapters">
      {before && <a href={`#/guide/${before.name}`}>← {before.title}</a>}
      {after && <a href={`#/guide/${after.name}`}>{after.title} →</a>}
    </nav>
  );
}
