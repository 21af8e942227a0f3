// A tour with the Go client of openapi-generator: tour URL.
package main

import (
	"bytes"
	"context"
	"errors"
	"io"
	"log"
	"os"

	api "example.com/client"
)

func must[T any](value T, _ any, err error) T {
	if err != nil {
		var refused *api.GenericOpenAPIError
		if errors.As(err, &refused) {
			log.Fatalf("%v: %s", err, refused.Body())
		}
		log.Fatal(err)
	}
	return value
}

func expect(holds bool, what string) {
	if !holds {
		log.Fatal(what)
	}
}

func beginning(file *os.File) []byte {
	_, err := file.Seek(0, io.SeekStart)
	expect(err == nil, "cannot read a file")
	head := make([]byte, 4)
	_, err = io.ReadFull(file, head)
	expect(err == nil, "cannot read a file")
	_, err = file.Seek(0, io.SeekStart)
	expect(err == nil, "cannot read a file")
	return head
}

func main() {
	log.SetFlags(log.Lshortfile)
	set := api.NewConfiguration()
	set.Servers = api.ServerConfigurations{{URL: os.Args[1]}}
	client, background := api.NewAPIClient(set), context.Background()

	server := must(client.ServiceAPI.GetServer(background).Execute())
	expect(server.Version != "", "no version")
	glb := must(client.ScenesAPI.GetSceneGltf(background, "cornell-box").Execute())
	expect(bytes.Equal(beginning(glb), []byte("glTF")), "no GLB")
	scene := must(client.ScenesAPI.CreateScene(background).Name("box.glb").Body(glb).Execute())
	expect(scene.Name == "box.glb" && scene.Triangles > 0, "no scene")

	request := api.NewJobRequest(scene.Id)
	request.SetSeed(9007199254740991)
	film := api.NewJobRequestFilm()
	film.SetWidth(48)
	film.SetHeight(32)
	film.SetCrop(*api.NewJobRequestFilmCrop(8, 0, 32, 32))
	request.SetFilm(*film)
	stop := api.NewJobRequestStop()
	stop.SetSamplesPerPixel(4)
	request.SetStop(*stop)
	made := must(client.JobsAPI.CreateJob(background).JobRequest(*request).Execute())
	expect(made.Job != nil, "no job")
	job := made.Job
	crop, hasCrop := job.Spec.Film.Get().GetCropOk()
	expect(hasCrop && crop.Width == 32, "no crop")
	expect(job.Spec.Seed == 9007199254740991, "another seed")
	for i := 0; i < 12 && job.State != api.FINISHED; i++ {
		job = must(client.JobsAPI.GetJob(background, job.Id).Wait(10).Execute())
	}
	expect(job.State == api.FINISHED, "not finished")
	expect(job.Statistics.Rays > 0, "no rays")

	picture := must(client.ResultsAPI.GetImageInFormat(background, job.Id, "png").Execute())
	expect(bytes.Equal(beginning(picture), []byte("\x89PNG")), "no PNG")
	patch := api.NewJobPatch()
	patch.SetName("tour")
	job = must(client.JobsAPI.PatchJob(background, job.Id).JobPatch(*patch).Execute())
	expect(job.Spec.Name == "tour", "not renamed")
	list := must(client.JobsAPI.ListJobs(background).Limit(10).Execute())
	expect(list.Jobs[0].Id == job.Id, "not in the list")

	_, _, err := client.JobsAPI.CreateJob(background).
		JobRequest(*api.NewJobRequest("nowhere")).Execute()
	var refused *api.GenericOpenAPIError
	expect(errors.As(err, &refused), "an unknown scene was accepted")
	problem, isProblem := refused.Model().(api.Problem)
	expect(isProblem && problem.Status == 404 && problem.Title != "", "not a problem")
}
