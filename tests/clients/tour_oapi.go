// A tour with the client of oapi-codegen: tour URL.
package main

import (
	"bytes"
	"context"
	"log"
	"os"

	"example.com/oapi/client"
)

func must[T any](value T, err error) T {
	if err != nil {
		log.Fatal(err)
	}
	return value
}

func expect(holds bool, what string) {
	if !holds {
		log.Fatal(what)
	}
}

func pointer[T any](value T) *T { return &value }

func main() {
	log.SetFlags(log.Lshortfile)
	api, background := must(client.NewClientWithResponses(os.Args[1])), context.Background()

	server := must(api.GetServerWithResponse(background)).JSON200
	expect(server != nil && server.Version != "", "no version")
	glb := must(api.GetSceneGltfWithResponse(background, "cornell-box")).Body
	expect(bytes.HasPrefix(glb, []byte("glTF")), "no GLB")
	uploaded := must(api.CreateSceneWithBodyWithResponse(background,
		&client.CreateSceneParams{Name: pointer("box.glb")}, "model/gltf-binary",
		bytes.NewReader(glb)))
	scene := uploaded.JSON201
	if scene == nil { // Another client has uploaded it.
		scene = uploaded.JSON200
	}
	expect(scene != nil && scene.Triangles > 0, "no scene")

	var request client.JobRequest
	request.Scene = scene.Id
	request.Seed = pointer(int64(9007199254740991))
	request.Film = &client.JobRequestFilm{Width: pointer(int32(48)), Height: pointer(int32(32)),
		Crop: &client.JobRequestFilmCrop{X: 8, Y: 0, Width: 32, Height: 32}}
	request.Stop = &client.JobRequestStop{SamplesPerPixel: pointer(int32(4))}
	made := must(api.CreateJobWithResponse(background, nil, request))
	expect(made.JSON201 != nil, string(made.Body))
	job := made.JSON201
	expect(job.Spec.Film.Crop != nil && job.Spec.Film.Crop.Width == 32, "no crop")
	expect(job.Spec.Seed == 9007199254740991, "another seed")
	for i := 0; i < 12 && job.State != "finished"; i++ {
		job = must(api.GetJobWithResponse(background, job.Id,
			&client.GetJobParams{Wait: pointer(10.0)})).JSON200
		expect(job != nil, "no job")
	}
	expect(job.State == "finished" && job.Statistics.Rays > 0, "not finished")

	picture := must(api.GetImageInFormatWithResponse(background, job.Id, "png", nil)).Body
	expect(bytes.HasPrefix(picture, []byte("\x89PNG")), "no PNG")
	list := must(api.ListJobsWithResponse(background, nil)).JSON200
	expect(list != nil && list.Jobs[0].Id == job.Id, "not in the list")

	refused := must(api.CreateJobWithResponse(background, nil,
		client.JobRequest{Scene: "nowhere"}))
	problem := refused.ApplicationproblemJSON404
	expect(problem != nil && problem.Status == 404 && problem.Title != "", "not a problem")
}
