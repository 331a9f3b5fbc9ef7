#include <cmath>

#include "kinds.h"

namespace bki_mapping::hostile {
namespace {

using geometry_msgs::TransformStamped;
using Message = TransformKind::Message;
using Messages = std::vector<Message>;

ros::Time shifted(const ros::Time& stamp, double seconds) {
  return stamp + ros::Duration(seconds);
}

TransformKind kind(const std::string& name, const std::string& sent, const Answers& answers,
                   const std::function<Messages(const std::string&, const ros::Time&, Dice&)>& make) {
  return {name, sent, answers, make};
}

/// Kinds with a single changed transform between the frame and the map.
TransformKind one(const std::string& name, const std::string& sent, const Answers& answers,
                  const std::function<void(TransformStamped&, Dice&)>& change) {
  return {name, sent, answers, [change](const std::string& frame, const ros::Time& stamp, Dice& dice) {
            TransformStamped t = honestTransform("map", frame, stamp);
            change(t, dice);
            return Messages{{false, {t}}};
          }};
}

std::vector<TransformKind> transformValueKinds() {
  return {
      one("tf/honest", "an honest transform", {"mapped"}, [](TransformStamped&, Dice&) {}),
      one("tf/translation_nan", "a translation that is NaN", {"bad transform"},
          [](TransformStamped& t, Dice&) { t.transform.translation.y = kNan; }),
      one("tf/translation_infinite", "an infinite translation", {"bad transform"},
          [](TransformStamped& t, Dice& dice) { t.transform.translation.x = dice.oneIn(2) ? kInf : -kInf; }),
      one("tf/translation_huge", "translations of 1e12 to 1e308 m, of the cloud's frame",
          {"bad transform", "mapped", "bad cloud"},
          [](TransformStamped& t, Dice& dice) {
            t.transform.translation.z = dice.oneOf<double>({1e12, -1e12, 1e18, 1e300, -1e308});
          }),
      one("tf/translation_far", "translations of 1 km to 1e6 m", {"mapped", "bad cloud"},
          [](TransformStamped& t, Dice& dice) {
            t.transform.translation.x = dice.oneOf<double>({1e3, -1e4, 1e5, -1e6});
            t.transform.translation.y = dice.oneOf<double>({1e3, -1e4, 1e5, -1e6});
          }),
      one("tf/translation_utm", "a translation in UTM coordinates", {"mapped", "bad transform", "bad cloud"},
          [](TransformStamped& t, Dice& dice) {
            t.transform.translation.x = dice.between(166e3, 834e3);
            t.transform.translation.y = dice.between(0.0, 10e6);
          }),
      one("tf/translation_denormal", "a translation of 5e-324 m", {"mapped"},
          [](TransformStamped& t, Dice&) { t.transform.translation.x = 5e-324; }),
      one("tf/rotation_nan", "a rotation that is NaN or infinite", {"bad transform"},
          [](TransformStamped& t, Dice& dice) { t.transform.rotation.x = dice.oneIn(2) ? kNan : kInf; }),
      one("tf/rotation_zero", "a quaternion of zeros", {"bad transform"},
          [](TransformStamped& t, Dice&) { t.transform.rotation.w = 0.0; }),
      one("tf/rotation_not_unit", "quaternions of length 0.5, 5 and 1e200", {"bad transform"},
          [](TransformStamped& t, Dice& dice) {
            t.transform.rotation.w = dice.oneOf<double>({0.5, 5.0, 1e200, -1e-200});
          }),
      one("tf/rotation_rounded", "a quaternion of length 1.001", {"mapped"},
          [](TransformStamped& t, Dice&) { t.transform.rotation.w = 1.001; }),
  };
}

std::vector<TransformKind> treeKinds() {
  return {
      one("tf/self", "a frame that is its own parent", {"bad transform"},
          [](TransformStamped& t, Dice&) { t.header.frame_id = t.child_frame_id; }),
      one("tf/child_empty", "no child frame", {"unknown frame"},
          [](TransformStamped& t, Dice&) { t.child_frame_id.clear(); }),
      one("tf/parent_empty", "no parent frame", {"bad transform"},
          [](TransformStamped& t, Dice&) { t.header.frame_id.clear(); }),
      one("tf/slash", "frames that begin with slashes", {"mapped"},
          [](TransformStamped& t, Dice&) {
            t.child_frame_id = "/" + t.child_frame_id;
            t.header.frame_id = "/map";
          }),
      one("tf/unconnected", "a parent that nothing connects", {"no transform"},
          [](TransformStamped& t, Dice&) { t.header.frame_id = t.child_frame_id + "_island"; }),
      kind("tf/loop", "a loop of two to five frames", {"no transform"},
           [](const std::string& frame, const ros::Time& stamp, Dice& dice) {
             const std::size_t length = 2 + dice.below(4);
             const auto name = [&](std::size_t n) {
               return n % length == 0 ? frame : frame + "_" + std::to_string(n % length);
             };
             Messages messages;
             for (std::size_t n = 0; n < length; ++n) {
               messages.push_back({false, {honestTransform(name(n + 1), name(n), stamp)}});
             }
             return messages;
           }),
      kind("tf/map_loop", "a loop through the map frame", {"mapped"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             return Messages{
                 {false, {honestTransform("map", frame, stamp), honestTransform(frame, "map", stamp)}}};
           }),
      kind("tf/reparented", "a frame that gets another parent, which nothing connects",
           {"mapped", "no transform"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             return Messages{{false, {honestTransform("map", frame, shifted(stamp, -1.0))}},
                             {false, {honestTransform(frame + "_island", frame, stamp)}}};
           }),
      kind("tf/reparented_back", "a frame that gets another parent and is given back", {"mapped"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             return Messages{{false, {honestTransform("map", frame, shifted(stamp, -1.0))}},
                             {false, {honestTransform(frame + "_island", frame, shifted(stamp, -0.5))}},
                             {false, {honestTransform("map", frame, stamp)}}};
           }),
      kind("tf/chain", "a chain of 100 frames", {"mapped"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             Messages messages(1);
             std::string child = frame;
             for (int n = 0; n < 100; ++n) {
               const std::string parent = n == 99 ? "map" : frame + "_" + std::to_string(n);
               messages[0].transforms.push_back(honestTransform(parent, child, stamp));
               child = parent;
             }
             return messages;
           }),
      kind("tf/flood", "200 new frames", {"mapped"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             Messages messages(1);
             messages[0].transforms.push_back(honestTransform("map", frame, stamp));
             for (int n = 0; n < 200; ++n) {
               messages[0].transforms.push_back(
                   honestTransform("map", frame + "_" + std::to_string(n), stamp));
             }
             return messages;
           }),
      kind("tf/name_long", "a parent's name of 100 kB", {"no transform"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             return Messages{{false, {honestTransform(std::string(100000, 'p'), frame, stamp)}}};
           }),
      kind("tf/name_not_utf8", "a parent's name that is not UTF-8", {"no transform"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             return Messages{{false, {honestTransform(std::string("\xff\0\n%s\033[2J", 9), frame, stamp)}}};
           }),
      kind("tf/empty", "no transform at all", {"unknown frame"},
           [](const std::string&, const ros::Time&, Dice&) {
             return Messages{{false, {}}, {true, {}}};
           }),
  };
}

std::vector<TransformKind> transformTimeKinds() {
  return {
      one("tf/stamp_0", "a stamp of 0", {"transform late", "mapped"},
          [](TransformStamped& t, Dice&) { t.header.stamp = ros::Time(); }),
      kind("tf/stamp_future", "stamps up to the year 2106, after honest ones", {"mapped", "too old"},
           [](const std::string& frame, const ros::Time& stamp, Dice& dice) {
             const ros::Time future(dice.oneOf<std::uint32_t>({stamp.sec + 60, 0x7fffffff, 0x80000000,
                                                               0xfffffff0, 0xfffffffe, 0xffffffff}),
                                    999999999);
             return Messages{{false, {honestTransform("map", frame, stamp)}},
                             {false, {honestTransform("map", frame, future)}},
                             {false, {honestTransform("map", frame, stamp)}}};
           }),
      kind("tf/stamp_future_first", "such stamps first, honest ones after them",
           {"mapped", "transform late", "too old"},
           [](const std::string& frame, const ros::Time& stamp, Dice& dice) {
             const ros::Time future(dice.oneOf<std::uint32_t>({stamp.sec + 60, 0x7fffffff, 0xffffffff}),
                                    999999999);
             return Messages{{false, {honestTransform("map", frame, future)}},
                             {false, {honestTransform("map", frame, stamp)}}};
           }),
      kind("tf/stamp_not_normal", "more than 1e9 ns", {"mapped", "too old", "transform late"},
           [](const std::string& frame, const ros::Time& stamp, Dice& dice) {
             Messages messages{
                 {false, {honestTransform("map", frame, stamp), honestTransform("map", frame, stamp)}}};
             ros::Time& odd = messages[0].transforms[dice.below(2)].header.stamp;
             odd.nsec = dice.oneOf<std::uint32_t>({1000000000, 0xfffffffe, 0xffffffff});
             if (dice.oneIn(2)) odd.sec = 0xffffffff;
             return messages;
           }),
      kind("tf/time_back", "stamps that go back", {"mapped"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             Messages messages;
             for (int n = 0; n < 20; ++n) {
               messages.push_back({false, {honestTransform("map", frame, shifted(stamp, -0.5 * n))}});
             }
             return messages;
           }),
      kind("tf/jump", "poses that jump by 3 m to 1 km between two clouds", {"mapped"},
           [](const std::string& frame, const ros::Time& stamp, Dice& dice) {
             Messages messages;
             const double jump = dice.oneOf<double>({3.0, 100.0, 1000.0});
             for (int n = 0; n < 10; ++n) {
               messages.push_back(
                   {false,
                    {honestTransform("map", frame, shifted(stamp, 0.1 * (n - 9)), n < 5 ? 0.0 : jump)}});
             }
             return messages;
           }),
      kind("tf/same_stamp", "1000 different transforms of one time", {"mapped"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             Messages messages(1);
             for (int n = 0; n < 1000; ++n)
               messages[0].transforms.push_back(honestTransform("map", frame, stamp, 0.01 * n));
             return messages;
           }),
      kind("tf/static", "a static transform", {"mapped"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             return Messages{{true, {honestTransform("map", frame, stamp)}}};
           }),
      kind("tf/static_nan", "a static transform that is NaN", {"bad transform"},
           [](const std::string& frame, const ros::Time& stamp, Dice&) {
             Messages messages{{true, {honestTransform("map", frame, stamp)}}};
             messages[0].transforms[0].transform.translation.x = kNan;
             return messages;
           }),
      kind("tf/static_and_not", "a frame both static and moving", {"mapped"},
           [](const std::string& frame, const ros::Time& stamp, Dice& dice) {
             const bool first = dice.oneIn(2);
             return Messages{{first, {honestTransform("map", frame, stamp)}},
                             {!first, {honestTransform("map", frame, stamp, 1.0)}}};
           }),
  };
}

}  // namespace

const std::vector<TransformKind>& transformKinds() {
  static const std::vector<TransformKind> kinds = [] {
    std::vector<TransformKind> all;
    for (const auto& part : {transformValueKinds(), treeKinds(), transformTimeKinds()}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }();
  return kinds;
}

TransformStamped honestTransform(const std::string& parent, const std::string& frame, const ros::Time& stamp,
                                 double x) {
  TransformStamped t;
  t.header.frame_id = parent;
  t.header.stamp = stamp;
  t.child_frame_id = frame;
  t.transform.translation.x = x;
  t.transform.rotation.w = 1.0;
  return t;
}

}  // namespace bki_mapping::hostile
