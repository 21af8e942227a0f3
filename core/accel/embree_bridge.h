/// Hides the differences between Embree 3.13 and 4.3.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace core::embree {

#if RTC_VERSION_MAJOR >= 4
inline void intersect1(RTCScene scene, RTCRayHit* rayhit) { rtcIntersect1(scene, rayhit); }
inline void occluded1(RTCScene scene, RTCRay* ray) { rtcOccluded1(scene, ray); }
inline void intersect8(const int* valid, RTCScene scene, RTCRayHit8* rayhit) {
  rtcIntersect8(valid, scene, rayhit);
}
inline void occluded8(const int* valid, RTCScene scene, RTCRay8* ray) {
  rtcOccluded8(valid, scene, ray);
}
#else
inline void intersect1(RTCScene scene, RTCRayHit* rayhit) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, rayhit);
}
inline void occluded1(RTCScene scene, RTCRay* ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, ray);
}
inline void intersect8(const int* valid, RTCScene scene, RTCRayHit8* rayhit) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect8(valid, scene, &context, rayhit);
}
inline void occluded8(const int* valid, RTCScene scene, RTCRay8* ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded8(valid, scene, &context, ray);
}
#endif

}  // namespace core::embree
