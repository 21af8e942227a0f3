import { useRef, useState } from 'preact/hooks';
import { imageUrl } from '../../api/client';
import { jobs, serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { form } from './form_model';
import { chooseScene, models, sceneName } from './scene_source';

/** For a model, the newest render that shows it; for a built-in scene, an image of the page. */
function pictureOf(scene: string, builtIn: boolean): string | null {
  if (builtIn) return `scenes/${encodeURIComponent(scene)}.jpg`;
  const shown = jobs.get()?.find((j) => j.spec.scene === scene && (j.revision ?? 0) > 0);
  return shown ? imageUrl(shown.id, 'jpg', { max_size: 240 }) : null;
}

function Thumb({ scene, builtIn }: { scene: string; builtIn: boolean }) {
  const [broken, setBroken] = useState('');
  const src = pictureOf(scene, builtIn);
  return (
    <span class="thumb scene-thumb">
      {src && src !== broken ? (
        <img src={src} alt="" loading="lazy" decoding="async" onError={() => setBroken(src)} />
      ) : (
        <span class="thumb-empty" />
      )}
    </span>
  );
}

/** An image of the selected scene; a press shows all scenes. */
export function SceneGallery() {
  const { scene } = useStore(form);
  const info = useStore(serverInfo);
  const own = useStore(models);
  const box = useRef<HTMLDialogElement>(null);
  const [open, setOpen] = useState(false);
  const builtIn = info?.scenes ?? [];
  const all = [
    ...own.map((s) => ({ id: s.id, name: sceneName(s.id), summary: '', builtIn: false })),
    ...builtIn.map((s) => ({ id: s.name, name: s.name, summary: s.summary, builtIn: true })),
  ];
  const choose = (id: string): void => {
    chooseScene(id);
    box.current?.close();
  };
  if (!scene) return null;
  return (
    <>
      <button
        type="button"
        class="scene-button"
        data-testid="scene-gallery"
        aria-label="Choose a scene from images"
        onClick={() => {
          setOpen(true);
          box.current?.showModal();
        }}
      >
        <Thumb key={scene} scene={scene} builtIn={builtIn.some((s) => s.name === scene)} />
      </button>
      <dialog
        ref={box}
        class="gallery"
        aria-label="Scenes"
        onClose={() => setOpen(false)}
        onClick={(e) => e.target === box.current && box.current?.close()}
      >
        {open && (
          <>
            <header class="page-head">
              <h2>Scenes</h2>
              <button type="button" class="quiet" onClick={() => box.current?.close()}>
                Close
              </button>
            </header>
            <ul class="gallery-list">
              {all.map((s) => (
                <li key={s.id}>
                  <button
                    type="button"
                    class="gallery-scene"
                    aria-pressed={s.id === scene}
                    data-scene={s.id}
                    onClick={() => choose(s.id)}
                  >
                    <Thumb scene={s.id} builtIn={s.builtIn} />
                    <strong>{s.name}</strong>
                    {s.summary && <span class="dim">{s.summary}</span>}
                  </button>
                </li>
              ))}
            </ul>
          </>
        )}
      </dialog>
    </>
  );
}
