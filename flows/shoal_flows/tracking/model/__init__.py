"""Identified machines as MLflow models: files, predictor, and promotion to champion."""
