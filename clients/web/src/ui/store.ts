import { useEffect, useReducer } from 'preact/hooks';

/** A value that components watch. */
export class Store<T> {
  private readonly listeners = new Set<() => void>();
  constructor(private value: T) {}

  get(): T {
    return this.value;
  }

  set(value: T): void {
    if (Object.is(value, this.value)) return;
    this.value = value;
    for (const listener of [...this.listeners]) listener();
  }

  subscribe(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}

export function useStore<T>(store: Store<T>): T {
  const [, again] = useReducer<number, void>((n) => n + 1, 0);
  const drawn = store.get();
  useEffect(() => {
    // It may have changed between drawing and subscribing.
    if (!Object.is(store.get(), drawn)) again();
    return store.subscribe(() => again());
  }, [store]);
  return drawn;
}

/** A store that persists in localStorage, where that is allowed. */
export function persistent<T>(
  key: string,
  initial: T,
  valid: (value: unknown) => value is T,
): Store<T> {
  let value = initial;
  try {
    const stored: unknown = JSON.parse(localStorage.getItem(key) ?? 'null');
    if (valid(stored)) value = stored;
  } catch {
    value = initial;
  }
  const store = new Store(value);
  store.subscribe(() => {
    try {
      localStorage.setItem(key, JSON.stringify(store.get()));
    } catch {
      return;
    }
  });
  return store;
}
