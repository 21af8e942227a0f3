import type { ComponentChildren } from 'preact';
import { useEffect, useRef, useState } from 'preact/hooks';

/**
 * A button that opens a small panel, which closes on Escape, on a selection and on a click
 * elsewhere.
 */
export function Menu({
  label,
  children,
  testId,
  class: extra = '',
}: {
  label: ComponentChildren;
  children: ComponentChildren;
  testId?: string;
  class?: string;
}) {
  const details = useRef<HTMLDetailsElement>(null);
  const [open, setOpen] = useState(false);
  useEffect(() => {
    const close = (e: Event): void => {
      const inside = details.current?.contains(e.target as Node);
      if (e.type === 'keydown' ? (e as KeyboardEvent).key !== 'Escape' : inside) return;
      if (details.current?.open && e.type === 'keydown')
        details.current.querySelector('summary')?.focus();
      details.current?.removeAttribute('open');
    };
    document.addEventListener('pointerdown', close);
    document.addEventListener('keydown', close);
    return () => {
      document.removeEventListener('pointerdown', close);
      document.removeEventListener('keydown', close);
    };
  }, []);
  const chosen = (e: Event): void => {
    if ((e.target as Element).closest('a, button[data-closes]'))
      details.current?.removeAttribute('open');
  };
  return (
    <details
      class={`menu ${extra}`}
      ref={details}
      onToggle={(e) => setOpen(e.currentTarget.open)}
    >
      <summary data-testid={testId}>{label}</summary>
      <div class="menu-panel" onClick={chosen}>
        {open && children}
      </div>
    </details>
  );
}
