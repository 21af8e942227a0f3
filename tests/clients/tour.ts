/** A tour with the client of openapi-generator (typescript-fetch): tour URL. */
import * as api from './client';

declare const process: { argv: string[]; exit(code: number): never };

function expect(holds: boolean, what: string) {
  if (!holds) throw new Error(what);
}

async function tour(basePath: string) {
  const settings = new api.Configuration({ basePath });
  const jobs = new api.JobsApi(settings);
  const scenes = new api.ScenesApi(settings);
  const results = new api.ResultsApi(settings);

  expect((await new api.ServiceApi(settings).getServer()).version !== '', 'no version');
  const glb = await scenes.getSceneGltf({ id: 'cornell-box' });
  const scene = await scenes.createScene({ body: glb, name: 'box.glb' });
  expect(scene.triangles > 0, 'no scene');

  const made = await jobs.createJob({
    jobRequest: {
      scene: scene.id,
      seed: 9007199254740991,
      film: { width: 48, height: 32, crop: { x: 8, y: 0, width: 32, height: 32 } },
      stop: { samplesPerPixel: 4 },
    },
  });
  let job = made as api.Job;
  expect(job.spec.film?.crop?.width === 32 && job.spec.seed === 9007199254740991, 'another job');
  for (let i = 0; i < 12 && job.state !== 'finished'; ++i)
    job = await jobs.getJob({ id: job.id, wait: 10 });
  expect(job.state === 'finished' && job.statistics.rays > 0, 'not finished');

  const picture = await results.getImageInFormat({
    id: job.id,
    format: api.GetImageInFormatFormatEnum.Png,
  });
  expect((await picture.text()).slice(1, 4) === 'PNG', 'no PNG');
  expect((await jobs.listJobs({ limit: 10 })).jobs[0].id === job.id, 'not in the list');

  const refused = await jobs.createJob({ jobRequest: { scene: 'nowhere' } }).then(
    () => null,
    (error: api.ResponseError) => error.response.json(),
  );
  expect(api.ProblemFromJSON(refused).status === 404, 'not a problem');
}

tour(process.argv[2]).catch((error) => {
  console.error(error);
  process.exit(1);
});
