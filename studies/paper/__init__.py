"""The paper redrawn from computation: a plate a figure, its statements judged model by model, one page of both."""
