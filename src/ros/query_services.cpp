#include "ros/query_services.h"

#include <utility>

#include "ros/queries/queries.h"
#include "ros/service_answer.h"

namespace bki_mapping::ros_interface {
namespace {

template <typename Request>
RecentMap::Shared mapFor(RecentMap& map, const Request&) {
  return map.get();
}
RecentMap::Shared mapFor(RecentMap& map, const GetFrontiers::Request& asked) {
  return boxOf(asked) ? map.get() : map.getForFrontiers();
}

}  // namespace

QueryServices::QueryServices(const ros::NodeHandle& node, ros::CallbackQueue& mapping, RecentMap::Take take)
    : node_(node), map_(std::move(take), mapping, background_) {
  node_.setCallbackQueue(&queue_);
  forEachQuery([this](const char* name, auto service) { offer<decltype(service)>(name); });
}

template <typename Service>
void QueryServices::offer(const std::string& name) {
  using Request = typename Service::Request;
  using Response = typename Service::Response;
  const boost::function<bool(Request&, Response&)> serve = [this](Request& asked, Response& response) {
    answer(response, [&] {
      Response made;  // so that a query that fails leaves the answer empty
      query(*mapFor(map_, asked), asked, made);
      response = std::move(made);
      return std::string();
    });
    return true;
  };
  services_.push_back(node_.advertiseService(name, serve));
}

}  // namespace bki_mapping::ros_interface
