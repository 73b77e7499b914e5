"""What was identified as a model of MLflow: its files, what it computes, and when it becomes the champion."""
