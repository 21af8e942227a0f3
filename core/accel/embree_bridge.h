/// Hides the differences between Embree 3.13 and 4.3.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace core::embree {

using HitFunction = void (*)(void* user, float t, unsigned instance, unsigned geometry,
                             unsigned primitive);
/// Returns whether the ray of this lane goes on behind the hit.
using PassFunction = bool (*)(void* user, unsigned lane, unsigned instance, unsigned geometry,
                              unsigned primitive);

#if RTC_VERSION_MAJOR >= 4
using Context = RTCRayQueryContext;
constexpr RTCSceneFlags kFilterFlag = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
inline void intersect1(RTCScene scene, RTCRayHit* rayhit) { rtcIntersect1(scene, rayhit); }
inline void start(Context& context) { rtcInitRayQueryContext(&context); }
inline RTCOccludedArguments arguments_of(Context& context) {
  RTCOccludedArguments out;
  rtcInitOccludedArguments(&out);
  out.context = &context;
  return out;
}
inline void occluded1(RTCScene scene, Context& context, RTCRay* ray) {
  RTCOccludedArguments arguments = arguments_of(context);
  rtcOccluded1(scene, ray, &arguments);
}
inline void occluded8(const int* valid, RTCScene scene, Context& context, RTCRay8* ray) {
  RTCOccludedArguments arguments = arguments_of(context);
  rtcOccluded8(valid, scene, ray, &arguments);
}
inline void intersect8(const int* valid, RTCScene scene, RTCRayHit8* rayhit) {
  rtcIntersect8(valid, scene, rayhit);
}
#else
using Context = RTCIntersectContext;
constexpr RTCSceneFlags kFilterFlag = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
inline void intersect1(RTCScene scene, RTCRayHit* rayhit) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, rayhit);
}
inline void start(Context& context) { rtcInitIntersectContext(&context); }
inline void occluded1(RTCScene scene, Context& context, RTCRay* ray) {
  rtcOccluded1(scene, &context, ray);
}
inline void occluded8(const int* valid, RTCScene scene, Context& context, RTCRay8* ray) {
  rtcOccluded8(valid, scene, &context, ray);
}
inline void intersect8(const int* valid, RTCScene scene, RTCRayHit8* rayhit) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect8(valid, scene, &context, rayhit);
}
#endif

/// Context of shadow rays, whose ids are their lanes.
struct PassContext {
  Context context;         ///< first: filters are given its address
  PassFunction does_pass;  ///< null: every hit ends its ray
  void* user;

  PassContext(PassFunction passes, void* of) : does_pass(passes), user(of) { start(context); }
};

/// Occlusion filter of geometries with holes.
inline void pass_hole(const RTCFilterFunctionNArguments* args) {
  const auto* to = reinterpret_cast<const PassContext*>(args->context);
  auto* ray = const_cast<RTCRayN*>(static_cast<const RTCRayN*>(args->ray));
  auto* hit = const_cast<RTCHitN*>(static_cast<const RTCHitN*>(args->hit));
  for (unsigned i = 0; i < args->N && to->does_pass != nullptr; ++i) {
    if (args->valid[i] == -1 &&
        to->does_pass(to->user, RTCRayN_id(ray, args->N, i), RTCHitN_instID(hit, args->N, i, 0),
                      RTCHitN_geomID(hit, args->N, i), RTCHitN_primID(hit, args->N, i))) {
      args->valid[i] = 0;
    }
  }
}

struct VisitContext {
  Context context;  ///< first: filters are given its address
  HitFunction visit;
  void* user;
};

/// Tells of a hit and rejects it, so that the traversal goes on.
inline void visit_and_reject(const RTCFilterFunctionNArguments* args) {
  const auto* to = reinterpret_cast<const VisitContext*>(args->context);
  const RTCRayN* ray = args->ray;
  const RTCHitN* hit = args->hit;
  to->visit(to->user, RTCRayN_tfar(const_cast<RTCRayN*>(ray), args->N, 0),
            RTCHitN_instID(const_cast<RTCHitN*>(hit), args->N, 0, 0),
            RTCHitN_geomID(const_cast<RTCHitN*>(hit), args->N, 0),
            RTCHitN_primID(const_cast<RTCHitN*>(hit), args->N, 0));
  args->valid[0] = 0;
}

inline void each_hit(RTCScene scene, RTCRayHit* rayhit, HitFunction visit, void* user) {
  VisitContext context{{}, visit, user};
  start(context.context);
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context.context;
  arguments.filter = &visit_and_reject;
  arguments.flags =
      static_cast<RTCRayQueryFlags>(arguments.flags | RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
  rtcIntersect1(scene, rayhit, &arguments);
#else
  context.context.filter = &visit_and_reject;
  rtcIntersect1(scene, &context.context, rayhit);
#endif
}

}  // namespace core::embree
