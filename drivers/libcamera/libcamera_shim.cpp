/*
 * The only file that speaks C++: libcamera 0.0.3 to 0.4. Its manager may exist once in a process
 * and lives while a camera is open.
 */
#include "drivers/libcamera/libcamera_shim.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <libcamera/libcamera.h>
#include <libcamera/logging.h>

using namespace libcamera;

namespace
{

std::weak_ptr<CameraManager> the_manager;
std::shared_ptr<CameraManager> held;

/* libcamera says on standard error what the driver says in its own words; who asks for its log by
 * its own variables gets it. */
void quieten()
{
	if (!getenv("LIBCAMERA_LOG_FILE") && !getenv("LIBCAMERA_LOG_LEVELS"))
		logSetTarget(LoggingTargetNone);
}

std::shared_ptr<CameraManager> start_manager()
{
	std::shared_ptr<CameraManager> manager = the_manager.lock();

	if (manager)
		return manager;
	quieten();
	manager = std::shared_ptr<CameraManager>(new CameraManager, [](CameraManager *old) {
		old->stop();
		delete old;
	});
	if (manager->start())
		return nullptr;
	the_manager = manager;
	return manager;
}

std::string model_of(const Camera &camera)
{
	return camera.properties().get(properties::Model).value_or("");
}

std::unique_ptr<CameraConfiguration> generate(Camera &camera, bool raw)
{
	std::unique_ptr<CameraConfiguration> configuration =
		camera.generateConfiguration({raw ? StreamRole::Raw : StreamRole::VideoRecording});

	return configuration && !configuration->empty() ? std::move(configuration) : nullptr;
}

const ControlId &id_of(libcamera_setting setting)
{
	if (setting == LIBCAMERA_EXPOSURE_US)
		return controls::ExposureTime;
	if (setting == LIBCAMERA_GAIN)
		return controls::AnalogueGain;
	return controls::FrameDurationLimits;
}

/* Limits that are a pair are the same twice. */
bool number(const ControlValue &value, double *out)
{
	if (value.isArray() || value.isNone())
		return false;
	if (value.type() == ControlTypeInteger32)
		*out = value.get<int32_t>();
	else if (value.type() == ControlTypeInteger64)
		*out = static_cast<double>(value.get<int64_t>());
	else if (value.type() == ControlTypeFloat)
		*out = value.get<float>();
	else
		return false;
	return true;
}

} // namespace

struct libcamera_device {
	std::shared_ptr<CameraManager> manager;
	std::shared_ptr<Camera> camera;
	std::string model;
	std::unique_ptr<CameraConfiguration> configuration;
	std::unique_ptr<FrameBufferAllocator> allocator;
	std::vector<std::unique_ptr<Request>> requests;
	libcamera_hooks hooks;

	Stream *stream() const { return configuration->at(0).stream(); }
	void drop_buffers();
	int make_buffers();
	bool has(const ControlId &id) const { return camera->controls().count(&id); }
	ControlList to_set(const libcamera_light &light) const;
	void complete(Request *request);
	void disconnected() { hooks.gone(hooks.user); }
};

void libcamera_device::drop_buffers()
{
	requests.clear();
	allocator.reset();
	configuration.reset();
}

int libcamera_device::make_buffers()
{
	allocator = std::make_unique<FrameBufferAllocator>(camera);
	int error = allocator->allocate(stream());

	if (error < 0)
		return error;
	for (const std::unique_ptr<FrameBuffer> &buffer : allocator->buffers(stream())) {
		std::unique_ptr<Request> request = camera->createRequest(requests.size());

		if (!request || request->addBuffer(stream(), buffer.get()))
			return -ENOMEM;
		requests.push_back(std::move(request));
	}
	return requests.empty() || requests.size() > LIBCAMERA_BUFFERS_MAX ? -ENOBUFS : 0;
}

ControlList libcamera_device::to_set(const libcamera_light &light) const
{
	ControlList list(camera->controls());
	double exposure_us = light.values[LIBCAMERA_EXPOSURE_US],
	       gain = light.values[LIBCAMERA_GAIN];
	int64_t period_us = static_cast<int64_t>(light.values[LIBCAMERA_PERIOD_US]);

	if ((exposure_us > 0 || gain > 0) && has(controls::AeEnable))
		list.set(controls::AeEnable, false);
	if (exposure_us > 0)
		list.set(controls::ExposureTime, static_cast<int32_t>(exposure_us));
	if (gain > 0)
		list.set(controls::AnalogueGain, static_cast<float>(gain));
	if (period_us > 0)
		list.set(controls::FrameDurationLimits, {period_us, period_us});
	return list;
}

/* libcamera's thread. */
void libcamera_device::complete(Request *request)
{
	const FrameMetadata &about = request->findBuffer(stream())->metadata();
	const ControlList &told = request->metadata();
	libcamera_done done = {};

	done.buffer = static_cast<uint32_t>(request->cookie());
	done.sequence = about.sequence;
	done.stamp_ns =
		told.get(controls::SensorTimestamp).value_or(static_cast<int64_t>(about.timestamp));
	done.exposure_ns = told.get(controls::ExposureTime).value_or(0) * INT64_C(1000);
	done.used_bytes = about.planes().empty() ? 0 : about.planes()[0].bytesused;
	done.end = request->status() != Request::RequestComplete ? LIBCAMERA_CANCELLED
		   : about.status != FrameMetadata::FrameSuccess ? LIBCAMERA_DAMAGED
								 : LIBCAMERA_WHOLE;
	hooks.done(hooks.user, &done);
}

int libcamera_shim_hold(void)
{
	held = start_manager();
	return held ? 0 : -EIO;
}

void libcamera_shim_let_go(void)
{
	held.reset();
}

int libcamera_shim_list(libcamera_found_fn *found, void *user)
{
	std::shared_ptr<CameraManager> manager = start_manager();
	int count = 0;

	if (!manager)
		return -EIO;
	for (const std::shared_ptr<Camera> &camera : manager->cameras()) {
		found(camera->id().c_str(), model_of(*camera).c_str(), user);
		count++;
	}
	return count;
}

int libcamera_shim_open(libcamera_device **out, const char *id)
{
	std::shared_ptr<CameraManager> manager = start_manager();
	std::shared_ptr<Camera> camera = manager ? manager->get(id) : nullptr;

	if (!camera)
		return manager ? -ENODEV : -EIO;
	int error = camera->acquire();

	if (error)
		return error;
	*out = new libcamera_device{manager, camera, model_of(*camera), {}, {}, {}, {}};
	return 0;
}

void libcamera_shim_close(libcamera_device *device)
{
	device->drop_buffers();
	device->camera->release();
	delete device;
}

void libcamera_shim_abandon(libcamera_device *device)
{
	device->camera->requestCompleted.disconnect(device);
	device->camera->disconnected.disconnect(device);
	device->manager.reset();
}

const char *libcamera_shim_model(const libcamera_device *device)
{
	return device->model.c_str();
}

void libcamera_shim_offers(libcamera_device *device, libcamera_offer_fn *offer, void *user)
{
	for (bool raw : {true, false}) {
		std::unique_ptr<CameraConfiguration> configuration = generate(*device->camera, raw);

		if (!configuration)
			continue;
		const StreamFormats &formats = configuration->at(0).formats();

		for (const PixelFormat &format : formats.pixelformats())
			for (const Size &size : formats.sizes(format))
				offer(raw, format.toString().c_str(), static_cast<int>(size.width),
				      static_cast<int>(size.height), user);
	}
}

int libcamera_shim_configure(libcamera_device *device, libcamera_stream *stream)
{
	device->drop_buffers();
	std::unique_ptr<CameraConfiguration> configuration = generate(*device->camera, stream->raw);

	if (!configuration)
		return -ENOTSUP;
	StreamConfiguration &wanted = configuration->at(0);
	PixelFormat format = PixelFormat::fromString(stream->format);
	Size size = wanted.size;

	if (stream->width_px)
		size.width = static_cast<unsigned>(stream->width_px);
	if (stream->height_px)
		size.height = static_cast<unsigned>(stream->height_px);
	wanted.pixelFormat = format;
	wanted.size = size;
	wanted.bufferCount = stream->buffer_count;
	if (configuration->validate() == CameraConfiguration::Invalid)
		return -EINVAL;
	snprintf(stream->format, sizeof(stream->format), "%s",
		 wanted.pixelFormat.toString().c_str());
	bool other = wanted.pixelFormat != format ||
		     (stream->width_px && wanted.size.width != size.width) ||
		     (stream->height_px && wanted.size.height != size.height);

	stream->width_px = static_cast<int>(wanted.size.width);
	stream->height_px = static_cast<int>(wanted.size.height);
	if (other)
		return 0;
	int error = device->camera->configure(configuration.get());

	if (error)
		return error;
	device->configuration = std::move(configuration);
	error = device->make_buffers();
	if (error)
		return error;
	stream->stride_bytes = static_cast<int>(device->configuration->at(0).stride);
	stream->buffer_count = static_cast<uint32_t>(device->requests.size());
	return 0;
}

libcamera_plane libcamera_shim_plane(const libcamera_device *device, uint32_t buffer)
{
	const FrameBuffer::Plane &plane =
		device->allocator->buffers(device->stream())[buffer]->planes()[0];
	bool has_offset = plane.offset != FrameBuffer::Plane::kInvalidOffset;

	return {plane.fd.get(), has_offset ? plane.offset : 0, plane.length};
}

bool libcamera_shim_range(const libcamera_device *device, libcamera_setting setting, double *low,
			  double *high)
{
	const ControlInfoMap &all = device->camera->controls();
	auto found = all.find(&id_of(setting));
	double from, to;

	if (found == all.end() || !number(found->second.min(), &from) ||
	    !number(found->second.max(), &to))
		return false;
	*low = from;
	*high = to;
	return true;
}

int libcamera_shim_start(libcamera_device *device, const libcamera_light *light,
			 const libcamera_hooks *hooks)
{
	ControlList list = device->to_set(*light);

	device->hooks = *hooks;
	device->camera->requestCompleted.connect(device, &libcamera_device::complete);
	device->camera->disconnected.connect(device, &libcamera_device::disconnected);
	int error = device->camera->start(&list);

	for (std::unique_ptr<Request> &request : device->requests) {
		if (error)
			break;
		request->reuse(Request::ReuseBuffers);
		if (request == device->requests.front())
			request->controls().merge(list); /* for those that pass over start's */
		error = device->camera->queueRequest(request.get());
	}
	if (error)
		libcamera_shim_stop(device);
	return error;
}

void libcamera_shim_stop(libcamera_device *device)
{
	device->camera->stop();
	device->camera->requestCompleted.disconnect(device);
	device->camera->disconnected.disconnect(device);
}

int libcamera_shim_queue(libcamera_device *device, uint32_t buffer)
{
	Request *request = device->requests[buffer].get();

	request->reuse(Request::ReuseBuffers);
	return device->camera->queueRequest(request);
}
