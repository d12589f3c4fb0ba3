/*
 * A shim: OpenCV speaks C++ only.
 */
#include "tests/bench/blobs_opencv.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

static cv::Mat binary, labels, stats, centroids;

static void threshold_frame(const uint8_t *pixels, int width_px, int height_px, int threshold)
{
	cv::Mat image(height_px, width_px, CV_8UC1, const_cast<uint8_t *>(pixels));

	cv::threshold(image, binary, threshold, 255, cv::THRESH_BINARY);
}

void opencv_init(int width_px, int height_px)
{
	cv::setNumThreads(1);
	binary.create(height_px, width_px, CV_8UC1);
	labels.create(height_px, width_px, CV_32SC1);
}

int opencv_contours(const uint8_t *pixels, int width_px, int height_px, int threshold)
{
	std::vector<std::vector<cv::Point>> contours;
	int count = 0;

	threshold_frame(pixels, width_px, height_px, threshold);
	cv::findContours(binary, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
	for (const auto &contour : contours)
		count += cv::moments(contour).m00 > 0;
	return count;
}

int opencv_components(const uint8_t *pixels, int width_px, int height_px, int threshold)
{
	threshold_frame(pixels, width_px, height_px, threshold);
	/* One of them is the dark. */
	return cv::connectedComponentsWithStats(binary, labels, stats, centroids) - 1;
}
