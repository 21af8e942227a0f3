package tour;

import java.io.File;
import java.nio.file.Files;
import java.util.Arrays;
import org.openapitools.client.ApiClient;
import org.openapitools.client.ApiException;
import org.openapitools.client.api.JobsApi;
import org.openapitools.client.api.ResultsApi;
import org.openapitools.client.api.ScenesApi;
import org.openapitools.client.api.ServiceApi;
import org.openapitools.client.model.Job;
import org.openapitools.client.model.JobRequest;
import org.openapitools.client.model.JobRequestFilm;
import org.openapitools.client.model.JobRequestFilmCrop;
import org.openapitools.client.model.JobRequestStop;
import org.openapitools.client.model.JobState;
import org.openapitools.client.model.Scene;

/** A tour with the Java client of openapi-generator: Tour URL. */
public final class Tour {
  private static void expect(boolean holds, String what) {
    if (!holds) {
      throw new IllegalStateException(what);
    }
  }

  private static boolean begins(File file, String text) throws java.io.IOException {
    byte[] all = Files.readAllBytes(file.toPath());
    byte[] wanted = text.getBytes(java.nio.charset.StandardCharsets.ISO_8859_1);
    return all.length > wanted.length
        && Arrays.equals(Arrays.copyOf(all, wanted.length), wanted);
  }

  public static void main(String[] arguments) throws Exception {
    ApiClient client = new ApiClient().setBasePath(arguments[0]);
    client.setReadTimeout(60000);
    JobsApi jobs = new JobsApi(client);
    ScenesApi scenes = new ScenesApi(client);

    expect(!new ServiceApi(client).getServer().getVersion().isEmpty(), "no version");
    File glb = scenes.getSceneGltf("cornell-box");
    expect(begins(glb, "glTF"), "no GLB");
    Scene scene = scenes.createScene(glb, "box.glb", null);
    expect(scene.getTriangles() > 0, "no scene");

    JobRequest request = new JobRequest()
        .scene(scene.getId())
        .seed(9007199254740991L)
        .film(new JobRequestFilm().width(48).height(32)
            .crop(new JobRequestFilmCrop().x(8).y(0).width(32).height(32)))
        .stop(new JobRequestStop().samplesPerPixel(4));
    Job job = jobs.createJob(request, null, null, null, null).getJob();
    expect(job.getSpec().getFilm().getCrop().getWidth() == 32, "no crop");
    expect(job.getSpec().getSeed() == 9007199254740991L, "another seed");
    for (int i = 0; i < 12 && job.getState() != JobState.FINISHED; ++i) {
      job = jobs.getJob(job.getId(), 10.0, null);
    }
    expect(job.getState() == JobState.FINISHED, "not finished");
    expect(job.getStatistics().getRays() > 0, "no rays");

    File picture = new ResultsApi(client).getImageInFormat(job.getId(), "png", null, null, null,
        null, null, null, null, null, null, null, null, null, null, null, null, null, null, null,
        null, null, null, null, null);
    expect(begins(picture, "\u0089PNG"), "no PNG");
    expect(jobs.listJobs(null, null, null, null, null, 10).getJobs().get(0).getId().equals(job.getId()),
        "not in the list");

    try {
      jobs.createJob(new JobRequest().scene("nowhere"), null, null, null, null);
      throw new IllegalStateException("an unknown scene was accepted");
    } catch (ApiException refused) {
      expect(refused.getCode() == 404 && refused.getResponseBody().contains("\"title\""),
          "not a problem");
    }
  }
}
