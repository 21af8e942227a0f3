/// What generators of clients need of schemas: names for all objects, and formats of numbers.
#pragma once

#include "api/json/json.h"

namespace api {

/// Moves the objects inside components to components of their own, named by the way to them:
/// JobRequest.film.crop becomes JobRequestFilmCrop. Objects that differ only in their description
/// share the first name. The description stays at the member, and null stays beside the reference:
/// generated code knows that a named object may be null, but not always that an object without a
/// name may be.
void name_parts(Json& schemas);

/// Adds the missing `format` of each integer and number in the document: int32 if its range has
/// room in it, else int64; double. Without it, generated code reads integers into 32 bits.
void add_number_formats(Json& document);

}  // namespace api
